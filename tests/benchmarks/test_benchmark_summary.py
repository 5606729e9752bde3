"""The summary of the benchmarks: its rows, what is refused, and what is written; no time means anything here."""

import json
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from tests.benchmarks import sections, summary
from tests.benchmarks.report import machine, write
from tests.benchmarks.sections import Options, Section
from tests.benchmarks.summary import SummaryRow, compared, ratio_row, refused_row

FIELDS = {field.name for field in fields(SummaryRow)}


def test_turns_of_both_are_paired():
    row = ratio_row("work", "peer", [10.0, 30.0, 24.0], [1.0, 2.0, 4.0], "to 0", least=8.0)
    assert (row.ratio, row.low, row.high, row.turns) == (10.0, 6.0, 15.0, 3)
    assert row.met == "yes" and row.goal == ">= 8"


def test_unequal_turns_are_compared_each_with_each():
    row = ratio_row("work", "peer", [12.0], [1.0, 2.0, 4.0], "to 0", least=8.0)
    assert (row.ratio, row.low, row.high, row.turns) == (6.0, 3.0, 12.0, 1)
    assert row.met == "no"


@pytest.mark.parametrize(("ratio", "met"), [(1.4, "yes"), (1.6, "no")])
def test_a_price_is_to_be_low(ratio: float, met: str):
    assert ratio_row("work", "peer", [ratio], [1.0], "to 0", most=1.5).met == met


def test_a_ratio_without_goal_is_not_judged():
    assert ratio_row("work", "peer", [2.0], [1.0], "to 0").met == ""


class Counted:
    """A function that counts its calls."""

    def __init__(self, answer: np.ndarray):
        self.answer, self.calls = answer, 0

    def __call__(self) -> np.ndarray:
        self.calls += 1
        return self.answer


@pytest.mark.parametrize("wrong", [np.array([1.0, 2.1]), np.array([1.0, np.nan]), np.array([1.0])])
def test_a_peer_that_disagrees_is_refused_and_not_timed(wrong: np.ndarray):
    theirs, ours = Counted(wrong), Counted(np.array([1.0, 2.0]))
    row = compared("work", "peer", theirs, ours, limit=1e-3, rounds=3, least=2.0)
    assert row.ratio is None and row.met == "refused" and "limit 1e-03" in row.agreement
    assert theirs.calls == 1


def test_a_peer_that_agrees_is_timed_in_turns():
    theirs, ours = Counted(np.array([1.0, 2.0 + 1e-6])), Counted(np.array([1.0, 2.0]))
    row = compared("work", "peer", theirs, ours, limit=1e-3, rounds=3)
    assert (theirs.calls, ours.calls, row.turns) == (4, 4, 3)
    assert row.low <= row.ratio <= row.high and row.agreement == "to 5.0e-07"


def test_everything_is_written(tmp_path: Path):
    rows = [ratio_row("some work", "a peer", [3.0, 4.0], [1.0, 1.0], "to 1e-9", least=2.0)]
    rows.append(refused_row("other work", "a liar", "differs by 1e+00, limit 1e-03", least=2.0))
    found = {"one": Section("## One\n", {"x": 1}, rows[:1]), "two": Section("## Two\n", [2], rows[1:])}
    text = write(tmp_path, found, machine())
    assert text == (tmp_path / "benchmarks.md").read_text(encoding="utf-8")
    assert text.index("## Summary") < text.index("## Machine") < text.index("## One") < text.index("## Two")
    assert "3 to 4" in text and "refused" in text
    numbers = json.loads((tmp_path / "benchmarks.json").read_text(encoding="utf-8"))
    assert numbers["one"] == {"x": 1} and numbers["two"] == [2]
    assert [row["section"] for row in numbers["summary"]] == ["one", "two"]
    for row in numbers["summary"]:
        assert set(row) == FIELDS | {"section", "goal", "met"}
    assert {"device", "load", "load_at_end", "jax", "cores"} <= set(numbers["machine"])


def test_columns_of_the_table_are_as_many_in_every_row():
    lines = summary.as_markdown([refused_row("a", "b", "c"), ratio_row("a", "b", [1.0], [1.0], "c")]).splitlines()
    table = [line for line in lines if line.startswith("|")]
    assert len(table) == 4 and len({line.count("|") for line in table}) == 1


def test_sections_are_found_and_run_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "made_up.py").write_text(
        "from tests.benchmarks.sections import Section\n\n\ndef section(options):\n"
        "    return Section('## Made up', options.rounds, [])\n",
        encoding="utf-8",
    )
    before = sections.names()
    monkeypatch.setattr(sections, "__path__", [*sections.__path__, str(tmp_path)])
    assert set(sections.names()) == {*before, "made_up"}
    assert sections.run("made_up", Options(tmp_path, rounds=7)).results == 7
