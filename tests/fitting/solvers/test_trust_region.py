"""Steps of a linear model against closed forms and SciPy's bounded solver."""

import jax
import numpy as np
import pytest
from scipy.optimize import lsq_linear

from fitting.solvers.trust_region import linear_model

ROWS, COLUMNS = 30, 5
_FREE = np.full(COLUMNS, np.inf)


@jax.jit
def _steps(residual, jacobian, lower, upper, weights, radius):
    model = linear_model(residual, jacobian, lower, upper)
    found = model.steps(weights * model.norms**0, radius, radius * 0)
    return model, found, model.promised(found.damped)


def _problem(seed, decades=0.0):
    random = np.random.default_rng(seed)
    sizes = 10.0 ** random.uniform(-decades, decades, COLUMNS)
    return random.standard_normal(ROWS), random.standard_normal((ROWS, COLUMNS)) * sizes


def test_gauss_newton_step_is_that_of_least_squares():
    residual, jacobian = _problem(0, decades=8.0)
    model, found, promised = _steps(residual, jacobian, -_FREE, _FREE, np.ones(COLUMNS), 1e6)
    norms = np.linalg.norm(jacobian, axis=0)
    np.testing.assert_allclose(model.norms, norms, rtol=1e-12)
    expected = np.linalg.lstsq(jacobian / norms, -residual, rcond=None)[0]
    np.testing.assert_allclose(found.newton, expected, rtol=1e-10)
    np.testing.assert_array_equal(found.damped, found.newton)
    assert float(found.damping) == 0.0
    left = residual + jacobian / norms @ expected
    assert float(promised) == pytest.approx(residual @ residual - left @ left, rel=1e-10)


@pytest.mark.parametrize("share", [0.9, 0.3, 1e-2, 1e-6])
@pytest.mark.parametrize("seed", range(5))
def test_damped_step_meets_the_radius_and_is_the_best_of_its_length(share, seed):
    residual, jacobian = _problem(seed)
    weights = np.random.default_rng(seed + 100).uniform(1, 1e3, COLUMNS)
    norms = np.linalg.norm(jacobian, axis=0)
    newton = np.linalg.lstsq(jacobian / norms, -residual, rcond=None)[0]
    radius = share * np.linalg.norm(weights * newton)
    _, found, promised = _steps(residual, jacobian, -_FREE, _FREE, weights, radius)
    length = np.linalg.norm(weights * found.damped)
    assert radius / 1.25 <= length <= 1.25 * radius
    # No other direction of that length promises more.
    random = np.random.default_rng(seed)
    for _ in range(20):
        other = np.asarray(weights * found.damped) + 0.3 * length * random.standard_normal(COLUMNS) / COLUMNS
        z = other / np.linalg.norm(other) * length / weights
        left = residual + jacobian / norms @ z
        assert residual @ residual - left @ left <= float(promised) * (1 + 1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_bounded_steps_are_scipys(seed):
    residual, jacobian = _problem(seed)
    norms = np.linalg.norm(jacobian, axis=0)
    reach = np.random.default_rng(seed).uniform(0.02, 0.1, COLUMNS)
    _, found, _ = _steps(residual, jacobian, -reach, reach, np.ones(COLUMNS), 1e6)
    expected = lsq_linear(jacobian, -residual, (-reach, reach), method="bvls", tol=1e-15)
    np.testing.assert_allclose(found.newton / norms, expected.x, atol=1e-9)
    np.testing.assert_array_equal(found.active, expected.active_mask != 0)
    short = 0.3 * np.linalg.norm(found.newton)
    _, found, _ = _steps(residual, jacobian, -reach, reach, np.ones(COLUMNS), short)
    assert np.linalg.norm(found.damped) == pytest.approx(short, rel=0.25)
    assert np.all(np.abs(found.damped) <= reach * norms * (1 + 1e-12))


def test_a_column_of_zeros_does_not_move():
    residual, jacobian = _problem(1)
    jacobian[:, 2] = 0.0
    for radius in (1e6, 1e-3):
        model, found, _ = _steps(residual, jacobian, -_FREE, _FREE, np.ones(COLUMNS), radius)
        assert not bool(model.seen[2])
        assert float(found.damped[2]) == 0.0
