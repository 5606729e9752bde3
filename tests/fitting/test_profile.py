"""Profile likelihood against closed forms, and where linear theory fails."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

from fitting.fit import fit
from fitting.profile import profile
from fitting.residuals.losses import HuberLoss
from fitting.residuals.robust import RobustResidual
from tests.fitting.curves import Coefficients, CurveResidual, box, line, noisy, saturation
from twin._checks import InputError
from twin.parameters import Parameter, ParameterSpace


@pytest.mark.slow
def test_a_line_has_the_profile_that_linear_theory_says():
    evidence = noisy(line, [1.0, 2.0], np.linspace(0, 1, 30), 0.1)
    result = fit(evidence, Coefficients(jnp.asarray([0.0, 0.0])), box(2, -100.0, 100.0))
    profiles = profile(evidence, result)
    for i, path in enumerate(("b.0", "b.1")):
        found = profiles[path]
        np.testing.assert_allclose(found.interval, result.intervals()[i], rtol=1e-6)
        # The profile t is a straight line, and the other parameter follows the correlation.
        np.testing.assert_allclose(
            found.ratio, (found.values - result.values[i]) / result.standard_errors[i], atol=1e-5
        )
        slope = result.covariance[1 - i, i] / result.covariance[i, i]
        np.testing.assert_allclose(
            found.others[:, 1 - i], result.values[1 - i] + slope * (found.values - result.values[i]), atol=1e-6
        )
        assert found.open == (False, False)
    assert profiles.lower_cost is None


def square(b, x):
    return b[0] ** 2 + 0 * x


@pytest.mark.slow
def test_a_parameter_that_enters_as_its_square_has_the_interval_of_the_square():
    """Likelihood intervals are invariant: those of b² are the squares of those of b, whatever linear theory says."""
    evidence = CurveResidual(square, np.zeros(8), np.full(8, 0.05) + 0.3 * np.sin(np.arange(8.0)), np.asarray(0.3))
    space = ParameterSpace([Parameter("b.0", "", 0.0, 10.0)])
    result = fit(evidence, Coefficients(jnp.asarray([0.5])), space, variance="known")
    found = profile(evidence, result, variance="known")["b.0"]
    mean, deviation = float(evidence.y.mean()), 0.3 / np.sqrt(8)
    reach = stats.norm.ppf(0.975) * deviation
    # Below, the bound ends it: the data cannot tell b from zero.
    assert found.interval[1] == pytest.approx(np.sqrt(mean + reach), rel=1e-4)
    assert found.interval[0] == 0.0
    assert found.open == (True, False)
    assert result.intervals()[0][0] < 0  # what linear theory says


@pytest.mark.slow
def test_what_the_data_leave_open_is_said_to_be_open():
    """Far below saturation only the ratio of the two parameters is known: no upper limit on either."""
    x = np.linspace(0.001, 0.02, 20)
    evidence = CurveResidual(saturation, x, np.asarray(saturation(np.asarray([2.0, 1.0]), x)), np.asarray(0.005))
    # So wide that neither is stopped by the other's bound.
    space = ParameterSpace([Parameter(f"b.{i}", "", 1e-2, upper, scale="log") for i, upper in ((0, 1e5), (1, 1e3))])
    result = fit(evidence, Coefficients(jnp.asarray([1.0, 1.0])), space, variance="known")
    found = profile(evidence, result, variance="known")
    assert found["b.1"].open == (False, True)
    assert found["b.1"].interval[1] == pytest.approx(1e3)
    assert 0 < found["b.1"].interval[0] < 1.0
    assert "above" in str(found)


def test_wrong_requests_are_refused():
    evidence = noisy(line, [1.0, 2.0], np.linspace(0, 1, 30), 0.1)
    result = fit(evidence, Coefficients(jnp.asarray([0.0, 0.0])), box(2, -100.0, 100.0))
    with pytest.raises(InputError, match="was not fitted"):
        profile(evidence, result, parameters=["b.7"])
    with pytest.raises(InputError, match="level must be between"):
        profile(evidence, result, level=1.5)
    with pytest.raises(InputError, match="variance must be"):
        profile(evidence, result, variance="exact")
    unfinished = fit(evidence, Coefficients(jnp.asarray([0.0, 0.0])), box(2, -100.0, 100.0), max_steps=0)
    with pytest.raises(InputError, match="starts from a minimum"):
        profile(evidence, unfinished)


@pytest.mark.slow
def test_intervals_hold_the_truth_where_those_of_linear_theory_do_not():
    """200 repeats of a curve that hardly saturates: linear intervals are symmetric, and too short above."""
    truth, space, repeats = np.asarray([1.0, 1.0]), box(2, 1e-3, 1e3), 200
    linear, likelihood = 0, 0
    for seed in range(repeats):
        evidence = noisy(saturation, truth, np.linspace(0.1, 1.0, 8), 0.07, seed)
        result = fit(evidence, Coefficients(jnp.asarray(truth)), space, variance="known")
        found = profile(evidence, result, parameters=["b.0"], variance="known", points=0)
        assert not found.message
        (low, high), (below, above) = result.intervals()[0], found["b.0"].interval
        linear += low <= truth[0] <= high
        likelihood += below <= truth[0] <= above
    assert 0.93 <= likelihood / repeats <= 0.97
    assert linear / repeats < 0.88


@pytest.mark.slow
def test_a_profile_of_a_robust_fit_agrees_with_its_standard_errors():
    """A straight line with gross outliers: the profile is that of the sandwich covariance, not of the inflated cost."""
    plain = noisy(line, [1.0, 2.0], np.linspace(0, 1, 60), 0.1)
    far = np.zeros(60)
    far[[5, 20, 41]] = 3.0
    evidence = RobustResidual(CurveResidual(line, plain.x, np.asarray(plain.y) + far, plain.deviation), HuberLoss())
    result = fit(evidence, Coefficients(jnp.asarray([0.0, 0.0])), box(2, -100.0, 100.0))
    found = profile(evidence, result, points=0)
    for i, path in enumerate(("b.0", "b.1")):
        np.testing.assert_allclose(found[path].interval, result.intervals()[i], atol=0.25 * result.standard_errors[i])
    with pytest.raises(InputError, match="Robust"):
        profile(evidence, result, variance="known")


def test_evidence_that_was_not_fitted_is_refused():
    evidence = noisy(line, [1.0, 2.0], np.linspace(0, 1, 30), 0.1)
    result = fit(evidence, Coefficients(jnp.asarray([0.0, 0.0])), box(2, -100.0, 100.0))
    with pytest.raises(InputError, match="residual that was fitted"):
        profile(noisy(line, [1.0, 2.0], np.linspace(0, 1, 30), 0.1, seed=1), result)


def ends_at_two(b, x):
    """A line that cannot be evaluated where its first coefficient is above 2."""
    return jnp.where(b[0] > 2.0, jnp.nan, line(b, x))


def test_an_end_that_cannot_be_reached_is_said_to_be_unknown():
    evidence = noisy(ends_at_two, [1.0, 2.0], np.linspace(0, 1, 10), 1.0)
    result = fit(evidence, Coefficients(jnp.asarray([1.0, 1.0])), box(2, -100.0, 100.0), variance="known")
    found = profile(evidence, result, parameters="b.0", variance="known", points=0)
    assert found["b.0"].open == (False, True)
    assert "b.0 held did not converge" in found.message
