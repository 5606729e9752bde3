"""Warnings of a fit: each appears where it should, with its cure, and none where all is well."""

import dataclasses

import numpy as np
import pytest

from fitting.controls import HeldBack, Permuted
from fitting.fit import fit
from fitting.identifiability import identifiability
from fitting.multistart import MultistartResult
from fitting.report import warnings_of
from tests.fitting.curves import LINE_X as X
from tests.fitting.curves import LINE_Y as Y
from tests.fitting.curves import Line, LineResidual
from twin.parameters import Parameter, ParameterSpace

START = Line(1.0, 1.0, 4.0)
SPACE = ParameterSpace([Parameter("a", "m", -10.0, 10.0), Parameter("b", "m/s", -10.0, 10.0)])
RESIDUAL = LineResidual(X - X.mean(), Y, 0.1)
NOISE = np.random.default_rng(3).standard_normal(500)


@pytest.fixture(scope="module")
def good():
    return fit(RESIDUAL, START, SPACE)


def many(result, clusters):
    count = len(clusters)
    costs = np.where(np.asarray(clusters) == 0, 1.0, 2.0)
    stops = np.array(["converged" if c >= 0 else "too_many_steps" for c in clusters], dtype=object)
    values = np.tile(result.values, (count, 1))
    return MultistartResult(SPACE, values, values, costs, stops, np.ones(count, int), np.asarray(clusters), {0: result})


def test_no_warning_where_all_is_well(good):
    controls = (HeldBack("held back", 1.0, 1.1, 2.0, {}, {}), Permuted("shuffled", 1.0, 9.0, 2.0, "converged"))
    found = warnings_of(
        good,
        identifiability=identifiability(good),
        many=many(good, [0] * 9 + [1]),
        residuals={"run: speed": NOISE},
        controls=controls,
    )
    assert found == []


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"stop": "too_many_steps"}, ["did not converge", "max_steps"]),
        ({"residual": 5 * NOISE[:40]}, ["times the standard deviations taken", "look at the shape"]),
        ({"residual": 0.1 * NOISE[:40]}, ["is only", "take the deviations from repeated records"]),
        ({"warning": "A remark of the procedure."}, ["A remark of the procedure."]),
    ],
)
def test_the_fit_itself(good, changes, said):
    (text,) = warnings_of(dataclasses.replace(good, **changes))
    assert all(part in text for part in said)


def test_parameters_at_a_bound_not_seen_or_correlated():
    space = ParameterSpace([Parameter("a", "m", 0.0, 2.0), Parameter("b", "m/s", -9.0, 9.0), Parameter("unused", "kg")])
    result = fit(LineResidual(X, Y, 0.5), START, space)
    for report in (None, identifiability(result)):
        text = " ".join(warnings_of(result, identifiability=report))
        assert "At a bound: a. If the bound is not physical, widen it" in text
        assert "Not seen by these data: unused. Hold them" in text
    shifted = fit(LineResidual(X + 9.0, Y, 0.1), START, ParameterSpace([Parameter("a", "m"), Parameter("b", "m/s")]))
    (text,) = warnings_of(shifted)
    assert "Closely correlated estimates: a and b (−1.00)" in text


def test_residuals_with_a_memory(good):
    slow = np.convolve(NOISE, np.ones(20))[:500]
    (text,) = warnings_of(good, residuals={"run: speed": slow, "run: force": NOISE})
    assert "The residual of run: speed is far from noise (autocorrelation 0.9" in text
    assert "mend the model" in text
    assert "fit with correlated errors" in text
    (text,) = warnings_of(dataclasses.replace(good, correlated=True), residuals={"run: speed": slow})
    assert "mend the model" in text
    assert "correlated errors" not in text
    (text,) = warnings_of(good, residuals={"run: speed": slow, "run: force": slow})
    assert "run: speed (0.9" in text and "run: force (0.9" in text


def test_controls_that_failed(good):
    controls = (
        HeldBack("held back", 1.0, 5.0, 2.0, {"x": 0.1}, {"x": 0.5}),
        Permuted("shuffled", 1.0, 1.1, 2.0, "converged"),
    )
    first, second = warnings_of(good, controls=controls)
    assert "held back” failed" in first and "5 times worse" in first and "x 50 % (fitted 10 %)" in first
    assert "shuffled” failed" in second and "do not trust its parameters" in second


def test_few_starts_found_the_best(good):
    (text,) = warnings_of(good, many=many(good, [0, 1, 1, 1, 2, 1, 1, 1]))
    assert "Only 1 of 8 starts found the best minimum" in text
    assert any("Only 3 of 9 starts converged" in t for t in warnings_of(good, many=many(good, [0, 0, 0] + [-1] * 6)))
    assert "None of 2 starts converged" in warnings_of(good, many=many(good, [-1, -1]))[0]
