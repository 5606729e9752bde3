"""The report of a fit as a whole: what is in it, in which order, how large it is, and how it looks on a phone."""

import re
import shutil
import subprocess

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.controls import held_back, permuted_control
from fitting.fit import fit
from fitting.identifiability import identifiability
from fitting.multistart import multistart
from fitting.report import Asked, Report, asked_section, fit_report, page_of, records_section, write_report
from fitting.report.compared import compared
from fitting.report.comparison import comparison_section
from fitting.report.residuals import residuals_section
from tests.fitting.controls.control_systems import (
    NOISE,
    SPACE,
    START,
    STEPPING,
    TIMES,
    Lag,
    Resonance,
    Wave,
    record_of,
    respond,
    response_of,
)
from tests.fitting.report.html_page import Page
from twin._checks import InputError
from twin.record import Record
from twin.simulation import simulate

EVIL = "<script>alert('x')</script>"
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


@pytest.fixture(scope="module")
def pieces():
    """A fit of a model that lacks a bend, with all that a report can hold."""
    reference = Wave(growth=0.3)
    record, evidence = record_of(Lag(2.0, 0.08, 0.03), reference)
    record = record.with_channel(EVIL, np.cos(TIMES), "A")
    result = fit(evidence, START, SPACE)
    speed = eqx.filter_jit(simulate)(result.model, reference, TIMES, stepping=STEPPING).channel("speed")
    mode = Resonance(40.0, 0.05)
    return {
        "title": "Speed loop " + EVIL,
        "asked": Asked("Identify the loop.", "Lag", study=EVIL, versions={"drivetwin": "0.1"}),
        "result": result,
        "records": {"run": record},
        "simulated": {"run": {"speed": speed}},
        "deviation": {"run": {"speed": NOISE}},
        "responses": {"hammer": (response_of(mode)[0], respond(mode, jnp.linspace(5.0, 120.0, 300)))},
        "identifiability": identifiability(result),
        "many": multistart(evidence, START, SPACE, starts=8, progress=False),
        "controls": (
            held_back(evidence, record_of(Lag(2.0, 0.2), reference)[1], result.model),
            permuted_control(evidence, START, SPACE, result.model),
        ),
        "remarks": {"run": ["The first second is left out."]},
        "stamp": "on a Monday",
    }


@pytest.fixture(scope="module")
def page(pieces):
    return page_of(fit_report(**pieces))


def test_page_is_well_formed_and_alone(page):
    found = Page(page)
    assert not re.search(r"https?:|@import|<link|<script|[^-]src=", page)
    drawings = found.all("svg")
    assert len(drawings) > 10
    assert all(attrs["aria-label"].strip() for attrs in drawings)
    assert page.count("on a Monday") == 1


def test_warnings_come_first_and_then_what_was_asked(page):
    titles = re.findall(r"<h2[^>]*>([^<]*)</h2>", page)
    assert titles[0].endswith("warnings")
    assert titles[1:4] == ["What was asked", "Data at a glance", "Fit against measurement"]
    assert "Controls" in titles and "Many starts" in titles and "Parameters" in titles
    assert page.index("Control “held back” failed") < page.index("<nav")


def test_numbers_have_the_digits_of_their_errors(pieces, page):
    for path, estimate in pieces["result"].estimates().items():
        row = page[page.index("Estimates</figcaption>") :]
        row = row[row.index(path.replace("_", "_<wbr>")) :]
        value, error = re.search(r">([0-9.]+) ±\s([0-9.]+)<", row).groups()
        assert float(value) == pytest.approx(estimate.value, abs=0.06 * estimate.standard_error)
        assert float(error) == pytest.approx(estimate.standard_error, rel=0.06)


def test_untrusted_names_are_escaped(page):
    assert EVIL not in page
    assert "&lt;script&gt;" in page


def test_the_same_input_gives_the_same_page(pieces, page):
    assert page_of(fit_report(**pieces)) == page


def test_least_report(pieces):
    text = page_of(fit_report(title="a", asked=Asked(), result=pieces["result"]))
    assert "Data at a glance" not in text
    assert "Correlation of the estimates" in text


def test_wrong_simulations_are_refused(pieces):
    short = {"run": {"speed": np.zeros(3)}}
    with pytest.raises(InputError, match="Simulate at the record's times"):
        fit_report(**{**pieces, "simulated": short})
    with pytest.raises(InputError, match="simulated names the record 'other'"):
        fit_report(**{**pieces, "simulated": {"other": {}}})


def test_long_records_stay_small_and_keep_their_peaks(tmp_path):
    rng = np.random.default_rng(1)
    count = 100_000
    samples = {name: rng.standard_normal(count) for name in ("a", "b", "c")}
    samples["a"][51_234] = 77.0
    times = np.arange(count) * 1e-4
    record = Record.create(times, samples, {"a": "m", "b": "m/s", "c": "N"}, name="long")
    series = compared(
        {"long": record},
        {"long": {name: values + 0.1 * rng.standard_normal(count) for name, values in samples.items()}},
        {"long": {"a": 0.1, "b": 0.1}},
    )
    sections = (
        records_section({"long": record}),
        comparison_section(series),
        residuals_section(series, {"long": record}),
    )
    path = write_report(tmp_path / "long.html", Report("long", asked_section(Asked()), sections=sections))
    assert path.stat().st_size < 3_000_000
    # The axis of the trace reaches up to the peak.
    assert ">60</text>" in path.read_text(encoding="utf-8")


@pytest.mark.skipif(CHROMIUM is None, reason="no browser here")
@pytest.mark.parametrize("width", [390, 1600])
def test_nothing_sticks_out_sideways(page, tmp_path, width):
    """Measured by the browser inside a frame, as its own window cannot be as narrow as a phone."""
    (tmp_path / "page.html").write_text(page, encoding="utf-8")
    frame = (
        f'<iframe id="f" src="page.html" width="{width}" height="900" style="border:0"></iframe><pre id="out"></pre>'
        "<script>f.onload=()=>{const d=f.contentDocument;const e=d.documentElement;"
        "const drawn=[...d.querySelectorAll('.picture svg')].map(s=>s.getBoundingClientRect().width);"
        "out.textContent='WIDTH '+e.scrollWidth+' OF '+e.clientWidth+' DRAWN '+Math.max(...drawn)+' END'}</script>"
    )
    (tmp_path / "frame.html").write_text(f"<!DOCTYPE html><body>{frame}</body>", encoding="utf-8")
    command = [str(CHROMIUM), "--headless", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files"]
    command += [f"--user-data-dir={tmp_path / 'profile'}", "--virtual-time-budget=10000", "--dump-dom"]
    done = subprocess.run(
        [*command, (tmp_path / "frame.html").as_uri()], capture_output=True, text=True, timeout=120, check=False
    )
    found = re.search(r"WIDTH (\d+) OF (\d+) DRAWN ([0-9.]+) END", done.stdout)
    assert found, done.stdout[-500:] + done.stderr[-500:]
    inside, window, drawn = (float(x) for x in found.groups())
    assert inside <= window <= width
    assert 0.5 * window < drawn <= window
