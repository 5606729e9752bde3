"""Derivatives of solutions against finite differences of solving again."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.solvers.implicit import solution_of
from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt
from fitting.solvers.slsqp import SLSQP

X = np.linspace(0, 2, 20)
DATA = 3 * np.exp(-1.3 * X) + 0.3 + 0.05 * np.sin(20 * X)


def decay(y, data):
    return y[0] * jnp.exp(-y[1] * jnp.asarray(X)) + y[2] - data


@pytest.mark.slow
@pytest.mark.parametrize("upper", [10.0, 1.0], ids=["free", "on a bound"])
def test_fit_with_respect_to_its_data(upper):
    def estimate(data):
        options = {"lower": jnp.zeros(3), "upper": jnp.asarray([10.0, upper, 10.0])}
        start = jnp.asarray([1.0, 0.9, 0.0])
        return solution_of(decay, BoundedLevenbergMarquardt(), start, data, options=options)[0]

    data, step = jnp.asarray(DATA), 1e-5
    solve = jax.jit(estimate)
    forward = jax.jit(jax.jacfwd(estimate))(data)
    for i in (0, 3, 19):
        change = jnp.zeros(20).at[i].set(step)
        slope = (solve(data + change) - solve(data - change)) / (2 * step)
        np.testing.assert_allclose(forward[:, i], slope, atol=2e-6)
    np.testing.assert_allclose(jax.jit(jax.jacrev(estimate))(data), forward, atol=1e-12)
    if upper == 1.0:
        np.testing.assert_allclose(forward[1], 0.0, atol=1e-15)


def distance(y, target):
    return (y[0] - target) ** 2 + (y[1] - 2 * target) ** 2


def inside_circle(y, target):
    return 1 - target * jnp.sum(y**2)[None]


@pytest.mark.slow
def test_minimum_under_a_constraint_that_moves():
    """The nearest point of the circle of radius 1/√a to (a, 2a) is (1, 2)/√(5a)."""

    def nearest(a):
        return solution_of(distance, SLSQP(), jnp.asarray([0.1, 0.1]), a, options={"inequality": inside_circle})[0]

    a = jnp.asarray(1.5)
    expected = np.asarray([1.0, 2.0]) / np.sqrt(5)
    np.testing.assert_allclose(nearest(a), expected / np.sqrt(1.5), rtol=1e-6)
    np.testing.assert_allclose(jax.jacfwd(nearest)(a), -0.5 * expected * 1.5**-1.5, rtol=1e-5)


def test_no_derivative_of_a_solution_that_is_none():
    def unfinished(data):
        start = jnp.asarray([1.0, 0.9, 0.0])
        return solution_of(decay, BoundedLevenbergMarquardt(), start, data, max_steps=1)

    (_, converged), tangent = jax.jvp(lambda d: unfinished(d), (jnp.asarray(DATA),), (jnp.ones(20),))
    assert not converged
    assert np.all(np.isnan(tangent[0]))
