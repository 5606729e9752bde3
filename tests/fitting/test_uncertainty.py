"""Covariances against closed forms and simulation, also where errors hang together over time."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import null_space

from fitting.uncertainty import correlation_time, covariance_of
from twin._checks import InputError


def autoregressive(rng, count, memory):
    noise = rng.standard_normal(count)
    series = np.empty(count)
    series[0] = noise[0] / np.sqrt(1 - memory**2)
    for k in range(1, count):
        series[k] = memory * series[k - 1] + noise[k]
    return series


def test_independent_errors_give_the_textbook_covariance():
    rng = np.random.default_rng(1)
    jacobian, residual = rng.standard_normal((200, 3)) * [1.0, 1e7, 1e-7], rng.standard_normal(200)
    expected = (
        residual @ residual / 197 * np.linalg.inv(jacobian.T @ jacobian / np.outer([1, 1e7, 1e-7], [1, 1e7, 1e-7]))
    )
    expected /= np.outer([1, 1e7, 1e-7], [1, 1e7, 1e-7])
    found = covariance_of(residual, jacobian, np.zeros(3, dtype=bool))
    np.testing.assert_allclose(found.matrix, expected, rtol=1e-9)
    assert found.degrees_of_freedom == 197


def test_correlation_time_of_an_autoregressive_series():
    series = autoregressive(np.random.default_rng(2), 200_000, 0.9)
    assert correlation_time(series[None]) == pytest.approx((1 + 0.9) / (1 - 0.9), rel=0.1)


def test_correlated_errors_widen_the_covariance_as_they_should():
    """The mean of an autoregressive series has (1 + φ)/(1 - φ) times the variance that independence claims."""
    rng = np.random.default_rng(3)
    jacobian = np.ones((4000, 1))
    ratios = []
    for _ in range(20):
        series = autoregressive(rng, 4000, 0.8)
        residual = series - series.mean()
        plain = covariance_of(residual, jacobian, np.zeros(1, dtype=bool)).matrix[0, 0]
        ratios.append(covariance_of(residual, jacobian, np.zeros(1, dtype=bool), series=1).matrix[0, 0] / plain)
    assert np.mean(ratios) == pytest.approx(9.0, rel=0.25)


def test_parameters_that_trade_places_are_both_unseen():
    rng = np.random.default_rng(4)
    first, second = rng.standard_normal((2, 50))
    jacobian = np.stack([first, 2 * first, second], axis=1)
    found = covariance_of(rng.standard_normal(50), jacobian, np.zeros(3, dtype=bool))
    assert found.unseen.tolist() == [True, True, False]
    assert np.isinf(found.condition_number)
    assert np.isfinite(found.matrix[2, 2])
    assert np.isnan(found.matrix[0, 0])


def test_priors_are_no_samples_of_a_series():
    """A prior row counts once, wherever the series end."""
    rng = np.random.default_rng(6)
    series = autoregressive(rng, 3000, 0.5)
    jacobian, residual = np.vstack([np.ones((3000, 1)), [[100.0]]]), np.append(series - series.mean(), 0.0)
    found = covariance_of(residual, jacobian, np.zeros(1, dtype=bool), series=1, priors=1)
    assert 0 < found.matrix[0, 0] < 1e-3
    with pytest.raises(ValueError, match="3001 residuals do not divide into 2 series"):
        covariance_of(residual, jacobian, np.zeros(1, dtype=bool), series=2)


def priors_case(seed=7, rows=30):
    """Rows of data and of two priors, on three parameters."""
    design = np.random.default_rng(seed).standard_normal((rows, 3))
    prior = np.array([[0.0, 4.0, 0.0], [0.0, 0.0, 9.0]])
    return design, prior


def test_exact_weights_and_priors_give_the_conjugate_posterior():
    design, prior = priors_case()
    rng = np.random.default_rng(8)
    jacobian = np.vstack([design, prior])
    posterior = np.linalg.inv(design.T @ design + prior.T @ prior)
    # Half the noise that the weights claim: a known variance does not care.
    found = covariance_of(0.5 * rng.standard_normal(32), jacobian, np.zeros(3, dtype=bool), priors=2, variance="known")
    np.testing.assert_allclose(found.matrix, posterior, rtol=1e-10)


@pytest.mark.parametrize("noise", [0.2, 1.0, 5.0])
def test_a_prior_is_absolute_where_the_variance_is_estimated(noise):
    """Data of another variance than their weights say, priors of the variance that they say: against the scatter."""
    design, prior = priors_case(rows=300)
    jacobian = np.vstack([design / 3, prior])
    rng = np.random.default_rng(9)
    draws = 4000
    errors = np.vstack([noise * rng.standard_normal((300, draws)), rng.standard_normal((2, draws))])
    estimates = np.linalg.lstsq(jacobian, errors)[0]
    residuals = jacobian @ estimates - errors
    matrices = [covariance_of(r, jacobian, np.zeros(3, bool), priors=2).matrix for r in residuals.T[:300]]
    np.testing.assert_allclose(np.sqrt(np.diag(np.mean(matrices, axis=0))), estimates.std(axis=1), rtol=0.05)


def test_degrees_of_freedom_count_what_the_data_determine():
    design, prior = priors_case()
    for weight, freedom in ((1e-6, 27), (1e6, 29)):
        jacobian = np.vstack([design, weight * prior])
        found = covariance_of(np.ones(32), jacobian, np.zeros(3, dtype=bool), priors=2)
        assert found.degrees_of_freedom == freedom


@given(st.integers(0, 10_000), st.integers(1, 3))
@settings(max_examples=25, deadline=None)
def test_constraints_project_the_covariance(seed, count):
    """Against restricted least squares written in a basis of what the constraints allow."""
    rng = np.random.default_rng(seed)
    scale = 10.0 ** rng.uniform(-6, 6, 5)
    jacobian, residual = rng.standard_normal((40, 5)) * scale, rng.standard_normal(40)
    normals = rng.standard_normal((count, 5)) * scale
    basis = null_space(normals / scale) / scale[:, None]
    reduced = jacobian @ basis
    expected = residual @ residual / (35 + count) * basis @ np.linalg.inv(reduced.T @ reduced) @ basis.T
    # A constraint given twice is one.
    found = covariance_of(residual, jacobian, np.zeros(5, dtype=bool), normals=np.vstack([normals, 2 * normals[:1]]))
    np.testing.assert_allclose(found.matrix * np.outer(scale, scale), expected * np.outer(scale, scale), atol=1e-10)
    assert found.degrees_of_freedom == 35 + count
    spread = normals @ found.matrix @ normals.T
    np.testing.assert_allclose(spread, 0.0, atol=1e-12 * np.abs(normals / scale).sum() ** 2)


def test_a_constraint_can_tell_what_the_data_do_not_see():
    rng = np.random.default_rng(11)
    jacobian = np.hstack([rng.standard_normal((50, 2)), np.zeros((50, 1))])
    residual = rng.standard_normal(50)
    none = np.zeros(3, dtype=bool)
    assert covariance_of(residual, jacobian, none).unseen.tolist() == [False, False, True]
    found = covariance_of(residual, jacobian, none, normals=np.array([[2.0, 0.0, -1.0]]))
    assert not found.unseen.any()
    assert found.matrix[2, 2] == pytest.approx(4 * found.matrix[0, 0], rel=1e-10)
    whole = covariance_of(residual, jacobian, none, normals=np.eye(3))
    assert np.all(whole.matrix == 0.0)
    # On a bound as well: what is left of the constraint holds.
    bound = covariance_of(residual, jacobian, np.array([True, False, False]), normals=np.array([[2.0, 0.0, -1.0]]))
    assert np.isnan(bound.matrix[0, 0])
    assert bound.matrix[2, 2] == pytest.approx(0.0, abs=1e-20)


def test_curvature_of_one_gives_the_variance_of_independent_errors_on_average():
    rng = np.random.default_rng(12)
    jacobian = np.hstack([np.ones((40, 1)), np.linspace(-1, 1, 40)[:, None] ** 3])
    none = np.zeros(2, dtype=bool)
    project = np.eye(40) - jacobian @ np.linalg.pinv(jacobian)
    ratios = []
    for _ in range(400):
        residual = project @ rng.standard_normal(40)
        robust = covariance_of(residual, jacobian, none, curvature=np.ones(40)).matrix
        ratios.append(np.diag(robust) / np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    np.testing.assert_allclose(np.mean(ratios, axis=0), 40 / 38, rtol=0.06)


def test_a_row_that_alone_determines_a_parameter_does_not_claim_to_do_so_exactly():
    rng = np.random.default_rng(13)
    jacobian = np.zeros((41, 2))
    jacobian[:40, 0], jacobian[40, 1] = 1.0, 1.0
    residual = rng.standard_normal(41)
    residual[:40] -= residual[:40].mean()
    residual[40] = 0.0
    found = covariance_of(residual, jacobian, np.zeros(2, dtype=bool), curvature=np.ones(41))
    assert found.matrix[1, 1] == pytest.approx(1.0, rel=0.4)


def test_a_point_that_is_no_minimum_has_no_covariance():
    jacobian = np.ones((10, 1))
    found = covariance_of(np.ones(10), jacobian, np.zeros(1, dtype=bool), curvature=np.linspace(-2, 1, 10))
    assert np.isnan(found.matrix[0, 0])
    assert not found.unseen[0]


def test_variances_that_contradict_each_other_are_refused():
    one = (np.ones(10), np.ones((10, 1)), np.zeros(1, dtype=bool))
    with pytest.raises(InputError, match='must be "estimated" or "known"'):
        covariance_of(*one, variance="guessed")
    for extra in ({"series": 1}, {"curvature": np.ones(10)}):
        with pytest.raises(InputError, match="contradicts correlated errors and robust losses"):
            covariance_of(*one, variance="known", **extra)
