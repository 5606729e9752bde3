"""Sections of reports for runs of other kinds, and for results that lack something."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.fit import fit
from fitting.profile import profile
from fitting.report import (
    Asked,
    Report,
    asked_section,
    correlation_section,
    fit_report,
    modes_section,
    page_of,
    parameters_section,
    profiles_section,
    ranking_section,
    records_section,
    responses_section,
    sweep_section,
)
from sensitivity.derivative_result import DerivativeMeasures
from sensitivity.sobol_result import SobolIndices
from tests.fitting.controls.control_systems import Resonance, response_of
from tests.fitting.curves import LINE_X as X
from tests.fitting.curves import LINE_Y as Y
from tests.fitting.curves import Line, LineResidual
from tests.fitting.report.html_page import Page
from twin._checks import InputError
from twin.linear import SecondOrder
from twin.modal import modes
from twin.parameters import Parameter, ParameterSpace
from twin.record import Record
from twin.sweep_result import Sweep

START = Line(1.0, 1.0, 4.0)
PARAMETERS = ParameterSpace([Parameter("loop.kp", "1/s", 1.0, 2.0), Parameter("loop.kv", "N s/m", 1.0, 2.0)])


def page(*sections):
    text = page_of(Report("t", asked_section(Asked()), sections=sections))
    Page(text)
    return text


def cells(section, table=0):
    return [[cell.text for cell in row] for row in section.tables[table].rows]


@pytest.fixture(scope="module")
def line():
    return fit(LineResidual(X, Y, 0.1), START, ParameterSpace([Parameter("a", "m"), Parameter("b", "m/s", -2.0, 3.0)]))


def test_parameters_with_and_without_bounds(line):
    section = parameters_section(line)
    (unbounded, bounded) = section.tables[0].rows
    assert unbounded[4].text == "not bounded"
    bar = bounded[4].bar
    assert bar.at == pytest.approx((line.values[1] + 2) / 5)
    np.testing.assert_allclose([bar.low, bar.high], (line.intervals()[1] + 2) / 5)
    assert "between −2 and 3" in bar.words
    assert page(section, correlation_section(line))


def test_parameters_at_a_bound_and_not_seen():
    space = ParameterSpace([Parameter("a", "m", 0.0, 2.0), Parameter("b", "m/s"), Parameter("unused", "kg")])
    result = fit(LineResidual(X, Y, 0.1), START, space)
    rows = cells(parameters_section(result))
    assert [row[5] for row in rows] == ["at a bound", "–", "not determined"]
    assert rows[0][3] == "–"
    assert parameters_section(result).tables[0].rows[0][4].bar.at == 1.0
    assert cells(correlation_section(result))[2][1:] == ["×", "×", "×"]


def test_a_fit_that_failed_has_a_report():
    bad = LineResidual(X, np.where(X > 1, np.nan, Y), 0.1)
    result = fit(bad, START, ParameterSpace([Parameter("a", "m"), Parameter("b", "m/s")]))
    text = page_of(fit_report(title="t", asked=Asked(), result=result))
    assert "The fit did not converge" in text
    assert "not converged" in text


def test_correlated_pairs_are_named(line):
    (remark,) = correlation_section(line).remarks
    assert "No two estimates" in remark
    close = fit(LineResidual(X + 2.0, Y, 0.1), START, line.space)
    (remark,) = correlation_section(close).remarks
    assert remark.startswith("a and b: −0.98")


def test_profiles(line):
    section = profiles_section(profile(LineResidual(X, Y, 0.1), line, points=3), line)
    assert [row[0] for row in cells(section)] == ["a", "b"]
    assert len(section.figures) == 2
    assert page(section)


def test_ranking_is_sorted_and_tinted():
    shares = np.array([[0.1, 0.9], [0.004, 0.5]])
    none = np.zeros((2, 0, 0))
    sobol = SobolIndices(
        PARAMETERS,
        ("loop.kp", "loop.kv"),
        ("overshoot", "error"),
        np.array([1.0, 0.0]),
        np.array([64]),
        shares[None],
        shares[None] / 10,
        shares[None],
        shares[None] / 10,
        none,
        none,
        1,
        0.95,
        100,
    )
    section = ranking_section(sobol, names={"loop.kv": "speed gain"})
    assert cells(section) == [["speed gain", "0.90", "0.50"], ["loop.kp", "0.10", ""]]
    assert [c.tint for c in section.tables[0].rows[0][1:]] == pytest.approx([-np.sqrt(0.9), -np.sqrt(0.5)])
    assert "Nothing moves error." in section.remarks
    assert page(section)
    derivative = DerivativeMeasures(
        PARAMETERS, ("overshoot", "error"), np.ones(2), shares, shares, 2 * shares, shares, 64, 1, 0.95
    )
    assert cells(ranking_section(derivative))[0] == ["loop.kv", "1.80", "1.00"]


def test_modes_of_a_chain():
    stiffness = np.array([[2.0, -1.0], [-1.0, 1.0]]) * 1e6
    matrices = {"mass": np.eye(2) * 10.0, "viscous": 1e-4 * stiffness, "hysteretic": np.zeros((2, 2))}
    system = SecondOrder(
        **{name: jnp.asarray(matrix) for name, matrix in matrices.items()},
        stiffness=jnp.asarray(stiffness),
        input_map=jnp.eye(2),
        output_map=jnp.eye(2),
        inputs=("f1", "f2"),
        outputs=("table", "bed"),
    )
    found = modes(system)
    section = modes_section(found, deviation=np.array([0.1, 0.2]), measured=found)
    # A chain of two: ω² = (3 ∓ √5)/2 · k/m.
    known = np.sqrt((3 - np.sqrt(5)) / 2 * 1e5) / (2 * np.pi)
    first = cells(section)[0]
    assert first[0] == "1"
    assert first[1] == f"{known:.2f} ± 0.10"
    assert first[3] == "bed"
    assert first[5] == "0 %"
    assert page(section)
    with pytest.raises(InputError, match="there are 2 modes"):
        modes_section(found, deviation=np.array([0.1]))


def test_sweeps_over_one_and_two_parameters():
    kp, kv = np.linspace(0.5, 2.0, 4), np.linspace(1.0, 3.0, 3)
    one = Sweep(
        PARAMETERS.parameters[:1], (kp,), (1.0,), False, {"error": np.where(kp > 1.9, np.nan, kp)}, {"error": "m"}
    )
    section = sweep_section(one, title="Gain")
    assert cells(section)[0][:2] == ["0.50000", "0.50000"]
    assert any("1 of 4 points" in remark for remark in section.remarks)
    two = Sweep(PARAMETERS.parameters, (kp, kv), (1.0, 1.0), False, {"error": np.outer(kp, kv)}, {"error": "m"})
    assert page(section, sweep_section(two)).count('class="picture"') == 2


def test_responses_with_and_without_variance_and_model():
    measured, _ = response_of(Resonance(40.0, 0.05))
    both = responses_section({"a": measured, "b": dataclasses.replace(measured, variance=None)}, units={"a": "m/N"})
    assert [row[5] for row in cells(both)] == ["2.0 %", "–"]
    assert "magnitude [m/N]" in page(both)
    against = responses_section({"a": measured}, {"a": dataclasses.replace(measured, values=1.1 * measured.values)})
    assert cells(against)[0][6] == "10.0 %"


def test_priors_and_ties_are_shown():
    space = ParameterSpace(
        [Parameter("m1", "kg", 1.0, scale="log", prior=(2.0, 0.5), tied=("m2",)), Parameter("k", "N/m")]
    )
    table = asked_section(Asked(model="two masses"), space).tables[1]
    assert table.head == ("Free parameter", "Unit", "From", "To", "Scale", "Prior", "Also sets")
    assert [cell.text for cell in table.rows[0]] == ["m1", "kg", "1", "∞", "log", "2 ± 0.5", "m2"]


def test_many_channels_are_not_all_drawn():
    times = np.arange(20) * 0.1
    names = [f"c{i}" for i in range(11)]
    record = Record.create(times, {n: np.ones(20) for n in names}, dict.fromkeys(names, "m"))
    section = records_section({"r": record})
    assert section.figures[0].panels == 8
    assert "first 8 channels are drawn of r" in section.remarks[0]
    assert len(section.tables[1].rows) == 11
    assert page(section)
