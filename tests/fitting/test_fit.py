"""Fits with known answers: estimates, errors and intervals against closed forms, bounds, priors, and bad input."""

import dataclasses

import numpy as np
import pytest
from scipy import stats

from fitting.fit import FitError, fit
from fitting.residuals.residual import JointResidual
from fitting.result import FitResult
from tests.fitting.curves import LINE_X as X
from tests.fitting.curves import LINE_Y as Y
from tests.fitting.curves import Line, LineResidual
from twin._checks import InputError
from twin.parameters import Parameter, ParameterSpace

RESIDUAL = LineResidual(X, Y)
START = Line(1.0, 1.0, 4.0)
SPACE = ParameterSpace([Parameter("a", "m"), Parameter("b", "m/s")])


@pytest.fixture(scope="module")
def result():
    return fit(RESIDUAL, START, SPACE)


def test_linear_regression(result):
    known = stats.linregress(X, Y)
    assert result.success
    np.testing.assert_allclose(result.values, [known.intercept, known.slope], rtol=1e-10)
    np.testing.assert_allclose(result.standard_errors, [known.intercept_stderr, known.stderr], rtol=1e-8)
    reach = stats.t.ppf(0.975, 38) * known.stderr
    np.testing.assert_allclose(result.intervals()[1], [known.slope - reach, known.slope + reach], rtol=1e-8)
    design = np.stack([np.ones_like(X), X], axis=1)
    inverse = np.linalg.inv(design.T @ design)
    assert result.correlation[0, 1] == pytest.approx(inverse[0, 1] / np.sqrt(inverse[0, 0] * inverse[1, 1]), rel=1e-8)
    assert result.degrees_of_freedom == 38


def test_scales_change_nothing_but_the_way(result):
    """Log and linear scales, and sizes of any magnitude, end at the same place with the same standard errors."""
    for options in ({"scale": "log"}, {"size": 1e-7}, {"size": 1e7}):
        space = ParameterSpace([Parameter("a", **options), Parameter("b")])
        other = fit(RESIDUAL, START, space)
        assert other.success
        np.testing.assert_allclose(other.values, result.values, rtol=1e-7)
        np.testing.assert_allclose(other.standard_errors, result.standard_errors, rtol=1e-6)


def test_log_interval_stays_positive():
    space = ParameterSpace([Parameter("a", scale="log"), Parameter("b")])
    noisy = LineResidual(X[:4], [0.1, 2.0, 0.2, 1.0])
    assert fit(noisy, START, space).intervals()[0, 0] > 0


def test_active_bound_is_reported():
    space = ParameterSpace([Parameter("a", "m", 0.0, 2.0), Parameter("b", "m/s")])
    bounded = fit(RESIDUAL, START, space)
    assert bounded.success
    assert bounded["a"].value == 2.0
    assert np.isnan(bounded["a"].standard_error)
    assert np.isfinite(bounded["b"].standard_error)
    assert "On a bound: a" in bounded.message
    assert bounded.to_dataframe().loc["a", "remark"] == "at a bound"
    # The rest is fitted as if the bound were the truth.
    slope = X @ (Y - 2.0) / (X @ X)
    assert bounded["b"].value == pytest.approx(slope, rel=1e-7)


def test_unseen_parameter_is_reported():
    space = ParameterSpace([Parameter("a"), Parameter("b"), Parameter("unused")])
    unseen = fit(RESIDUAL, START, space)
    assert unseen.success
    assert unseen["unused"].value == 4.0
    assert "Not determined by these data: unused" in unseen.message
    assert np.isinf(unseen.condition_number)
    np.testing.assert_allclose(unseen.standard_errors[:2], fit(RESIDUAL, START, SPACE).standard_errors, rtol=1e-8)


def test_prior_pulls_by_its_weight():
    space = ParameterSpace([Parameter("a", prior=(5.0, 1e-6)), Parameter("b")])
    assert fit(RESIDUAL, START, space)["a"].value == pytest.approx(5.0, abs=1e-6)


def test_held_parameters_stay_and_are_not_reported(result):
    held = fit(RESIDUAL, START, SPACE, hold=["b"])
    assert held.space.paths == ("a",)
    assert held.model.b == 1.0
    assert held["a"].value == pytest.approx(np.mean(Y - X), rel=1e-10)


def test_joint_residuals_add_up(result):
    half = [LineResidual(X[s], Y[s]) for s in (slice(0, 15), slice(15, 40))]
    joint = fit(JointResidual(tuple(half)), START, SPACE)
    np.testing.assert_allclose(joint.values, result.values, rtol=1e-9)


def test_save_and_load(result, tmp_path):
    result.save(tmp_path / "fit.npz")
    loaded = FitResult.load(tmp_path / "fit.npz", START)
    np.testing.assert_array_equal(loaded.values, result.values)
    np.testing.assert_array_equal(loaded.covariance, result.covariance)
    assert (loaded.stop, loaded.space.paths, loaded.message) == (result.stop, result.space.paths, result.message)
    assert loaded.model.a == result.model.a
    assert loaded.model.unused == START.unused


def test_shows_itself(result):
    assert "<table" in result._repr_html_()
    assert "converged" in result._repr_html_()
    assert "standard error" in repr(result)
    assert list(result.to_dataframe().index) == ["a", "b"]


def test_intervals_of_a_fit_that_did_not_converge_are_marked(result):
    remark = "Standard errors and intervals hold only at a converged fit."
    assert remark not in repr(result)
    for stop in ("too_many_steps", "infeasible", "stalled"):
        stopped = dataclasses.replace(result, stop=stop)
        for text in (repr(stopped), stopped._repr_html_()):
            assert "NOT converged" in text
            assert remark in text


@pytest.mark.parametrize(
    ("space", "message"),
    [
        ([Parameter("c")], "Unknown parameter path 'c'.*a, b, unused"),
        ([Parameter("a", "m", 2.0, 3.0)], r"The start of a is 1 m, outside its bounds \[2, 3\]"),
        ([Parameter("a"), Parameter("b"), Parameter("unused")], "2 residuals cannot determine 3 parameters"),
    ],
)
def test_what_cannot_be_fitted_is_refused(space, message):
    short = LineResidual(X[:2], Y[:2])
    with pytest.raises(InputError, match=message):
        fit(short, START, ParameterSpace(space))


def test_residual_that_is_not_finite_is_a_status():
    bad = LineResidual(X, np.where(X > 1, np.nan, Y))
    result = fit(bad, START, SPACE)
    assert not result.success
    assert "not finite at the start" in result.message
    assert np.isnan(result.cost) and np.isnan(result.rms)
    for text in (repr(result), result._repr_html_()):
        assert "NOT converged in 0 steps, weighted residual not evaluated" in text
        assert "hold only" not in text
    with pytest.raises(FitError, match="not finite at the start"):
        fit(bad, START, SPACE, throw=True)


def test_reversed_bounds_are_refused():
    with pytest.raises(InputError, match="a: the lower bound 3 is not below the upper bound 2 m"):
        Parameter("a", "m", 3.0, 2.0)


def test_level_outside_zero_and_one_is_refused(result):
    with pytest.raises(InputError, match="level must be between 0 and 1"):
        result.intervals(95.0)
