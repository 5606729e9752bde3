"""The page of a report: well formed, without outside addresses, escaped, whole, and the same for the same input."""

import re
import warnings

import numpy as np
import pytest

from fitting.report import Bar, Cell, Figure, Folded, Report, Section, Table, page_of, write_report
from tests.fitting.report.html_page import Page
from twin._checks import InputError

EVIL = '<script>alert("x")</script> & $a$ _b'


def draw(axes):
    for ax in axes:
        ax.plot([0, 1], [0, 1], label=EVIL)
        ax.plot([0, 1], [1, 0], color="k", label="other")
        ax.set_xlabel(EVIL)
        ax.legend()


def small(**changes):
    table = Table((EVIL, "b"), ((Cell(EVIL, "name"), Cell("", bar=Bar(0.5, 0.4, 0.6, EVIL))),), EVIL)
    figures = (Figure(draw, EVIL, EVIL, wide=True, panels=2), Figure(draw, "a picture"))
    section = Section(EVIL, EVIL, figures, (table,), (EVIL,), (Folded(EVIL, EVIL),))
    report = {"warnings": (EVIL,), "sections": (section,), "facts": ((EVIL, EVIL),), "stamp": EVIL}
    return Report(EVIL, Section("What was asked"), **{**report, **changes})


def test_page_is_well_formed_and_says_who_is_who():
    page = Page(page_of(small()))
    names = [attrs["id"] for _, attrs in page.seen if "id" in attrs]
    assert len(names) == len(set(names))
    targets = [attrs["href"] for _, attrs in page.seen if "href" in attrs]
    assert targets and all(target[0] == "#" and target[1:] in names for target in targets)


def test_page_needs_nothing_from_outside():
    text = page_of(small())
    assert not re.search(r"https?:|//[a-z]|@import|<link|<script|src=", text.replace("&lt;script", ""))


def test_every_drawing_has_a_text():
    drawings = Page(page_of(small())).all("svg")
    assert len(drawings) == 4
    assert all(attrs["role"] == "img" and attrs["aria-label"].strip() for attrs in drawings)
    with pytest.raises(InputError, match="alt text"):
        Figure(draw, " ")


def test_names_are_escaped():
    text = page_of(small())
    assert "<script" not in text
    assert text.count("&lt;script&gt;") > 10


def test_warnings_come_before_the_contents():
    text = page_of(small(warnings=("Mind the gap.", "And this.")))
    assert text.index("Mind the gap.") < text.index("<nav")
    assert "2 warnings" in text
    assert "Nothing to warn of" in page_of(small(warnings=()))


def test_the_same_report_gives_the_same_page():
    assert page_of(small()) == page_of(small())


def test_colours_are_the_pages_own():
    text = page_of(small())
    drawing = text[text.index("<svg viewBox", text.index('class="picture')) :]
    assert "var(--c0)" in drawing
    assert "var(--g0)" in drawing
    assert "#000000" not in drawing


def test_written_whole_or_not_at_all(tmp_path):
    def fails(axes):
        raise RuntimeError("no")

    path = tmp_path / "report.html"
    assert write_report(path, small()) == path
    before = path.read_text(encoding="utf-8")
    with pytest.raises(RuntimeError):
        write_report(path, small(sections=(Section("a", figures=(Figure(fails, "b"),)),)))
    assert path.read_text(encoding="utf-8") == before
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]
    with pytest.raises(InputError, match="does not exist"):
        write_report(tmp_path / "none" / "report.html", small())


def test_names_in_any_letters(tmp_path):
    odd = "速度 \x07 $x_"

    def names(axes):
        axes[0].plot([0, 1], [0, 1])
        axes[0].set_xlabel(odd)

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        section = Section(odd, odd, figures=(Figure(names, odd),))
        path = write_report(tmp_path / "odd.html", small(sections=(section,)))
    assert "速度" in path.read_text(encoding="utf-8").split('class="picture"')[1]


def test_rows_have_a_cell_for_each_head():
    with pytest.raises(InputError, match="has 1 cells"):
        Table(("a", "b"), ((Cell("1"),),))


def test_drawing_leaves_matplotlib_as_it_was():
    import matplotlib

    before = dict(matplotlib.rcParams)
    page_of(small())
    assert dict(matplotlib.rcParams) == before
    assert np.isfinite(before["font.size"])
