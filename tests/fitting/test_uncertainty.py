"""Covariances against closed forms and simulation, also where errors hang together over time."""

import numpy as np
import pytest

from fitting.uncertainty import correlation_time, covariance_of


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
