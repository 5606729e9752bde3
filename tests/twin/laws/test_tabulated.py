"""Tabulated friction: against SciPy's PCHIP, at the points, beyond them, and where chords vanish."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import PchipInterpolator

from twin._checks import InputError
from twin.laws import TabulatedFriction

X = np.array([-1.0, -0.4, -0.1, 0.0, 0.05, 0.3, 1.0, 1.1])


@jax.jit
def _evaluate(forces, velocity):
    return TabulatedFriction(jnp.asarray(X), forces)(velocity)


@jax.jit
def _at(speeds, forces, velocity):
    return TabulatedFriction(speeds, jnp.asarray(forces))(velocity)


_BY_SPEEDS = jax.jit(jax.jacfwd(_at, argnums=0))
_BY_FORCES = jax.jit(jax.jacfwd(_evaluate, argnums=0))
_BY_FORCES_REVERSE = jax.jit(jax.jacrev(_evaluate, argnums=0))


@given(st.lists(st.floats(-100.0, 100.0), min_size=X.size, max_size=X.size))
@settings(max_examples=40, deadline=None)
def test_agrees_with_scipy(forces):
    # Neighbours that differ by next to nothing make SciPy's quotients overflow.
    forces = np.round(np.array(forces), 3)
    v = np.linspace(X[0], X[-1], 61)
    expected = PchipInterpolator(X, forces)(v)
    np.testing.assert_allclose(_evaluate(forces, v), expected, rtol=1e-9, atol=1e-9)


@given(st.lists(st.floats(0.0, 10.0), min_size=X.size, max_size=X.size))
@settings(max_examples=30, deadline=None)
def test_is_monotone_where_the_table_is(increments):
    forces = np.cumsum(increments)
    curve = _evaluate(forces, np.linspace(X[0], X[-1], 61))
    assert np.all(np.diff(curve) >= -1e-12)


def test_passes_through_its_points_and_goes_on_straight():
    forces = np.array([-9.0, -5.0, -4.0, 0.0, 4.0, 5.0, 9.0, 10.0])

    def law(velocity):
        return _evaluate(forces, velocity)

    np.testing.assert_allclose(law(X), forces, rtol=1e-14, atol=1e-14)
    slope = jax.jit(jax.vmap(jax.grad(law)))
    first, last = slope(jnp.array([X[0], X[-1]]))
    outside = np.array([X[0] - 2.0, X[-1] + 3.0])
    np.testing.assert_allclose(law(outside), [forces[0] - 2 * first, forces[-1] + 3 * last], rtol=1e-13)
    # One continuous slope across points and ends.
    np.testing.assert_allclose(slope(jnp.asarray(X - 1e-9)), slope(jnp.asarray(X + 1e-9)), rtol=1e-5)


def test_two_points_make_a_straight_line():
    law = TabulatedFriction(jnp.array([-1.0, 1.0]), jnp.array([-3.0, 5.0]))
    np.testing.assert_allclose(law(jnp.array([-2.0, 0.0, 0.5, 4.0])), [-7, 1, 3, 17], rtol=1e-14)


@pytest.mark.parametrize("velocity", [-1.7, -1.0, -0.2, 0.0, 0.02, 0.7, 1.1, 2.0])
def test_derivatives_with_respect_to_the_forces(velocity):
    forces = jnp.array([-9.0, -5.0, -6.0, 0.0, 4.0, 3.0, 9.0, 10.0])
    derivative = _BY_FORCES(forces, jnp.array(velocity))
    np.testing.assert_allclose(derivative, _BY_FORCES_REVERSE(forces, jnp.array(velocity)), rtol=1e-12, atol=1e-14)
    for k in range(X.size):
        up, down = (_evaluate(forces.at[k].add(s * 1e-5), jnp.array(velocity)) for s in (1, -1))
        assert derivative[k] == pytest.approx(float(up - down) / 2e-5, rel=1e-6, abs=1e-8)
    # Raising the whole table raises the curve.
    assert float(jnp.sum(derivative)) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("velocity", [-1.7, -0.2, 0.02, 0.7, 2.0])
@pytest.mark.parametrize(
    "forces", [[-9.0, -5.0, -6.0, 0.0, 4.0, 3.0, 9.0, 10.0], [-9.0, -5.0, -5.0, 0.0, 4.0, 4.0, 9.0, 10.0]]
)
def test_derivatives_with_respect_to_the_speeds(velocity, forces):
    """Of the motion and of the table, also beside chords of zero."""
    exact = _BY_SPEEDS(jnp.asarray(X), jnp.asarray(forces), jnp.asarray(velocity))
    numeric = [
        (_at(X + step, forces, velocity) - _at(X - step, forces, velocity)) / 2e-6 for step in 1e-6 * np.eye(X.size)
    ]
    np.testing.assert_allclose(exact, numeric, rtol=1e-5, atol=1e-6)
    # Shifting the whole table is shifting the motion the other way.
    slope = _at(X, forces, velocity + 1e-6) - _at(X, forces, velocity - 1e-6)
    assert float(jnp.sum(exact)) == pytest.approx(-float(slope) / 2e-6, rel=1e-5, abs=1e-6)


def test_maps_over_tables():
    forces = np.stack([X, 2 * X, X**3, np.zeros(X.size)])
    together = jax.vmap(_evaluate, (0, None))(jnp.asarray(forces), jnp.asarray(X))
    np.testing.assert_allclose(together, forces, rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize("forces", [np.zeros(X.size), np.repeat([1.0, 2.0], 4), np.tile([1.0, -1.0], 4)])
def test_derivatives_are_finite_where_chords_vanish_or_turn(forces):
    for velocity in (X[0] - 1, X[0], 0.0, 0.01, 0.2, X[-1], X[-1] + 1):
        assert np.all(np.isfinite(_BY_FORCES(forces, jnp.array(velocity))))
        assert np.all(np.isfinite(_BY_FORCES_REVERSE(forces, jnp.array(velocity))))


@pytest.mark.parametrize(
    ("velocities", "forces", "named"),
    [
        ([0.0, 1.0, 1.0], [0.0, 1.0, 2.0], "velocities"),
        ([0.0, 2.0, 1.0], [0.0, 1.0, 2.0], "velocities"),
        ([0.0], [0.0], "velocities"),
        ([[0.0, 1.0]], [[0.0, 1.0]], "velocities"),
        ([0.0, 1.0], [0.0, 1.0, 2.0], "forces"),
        ([0.0, 1.0], [0.0, np.nan], "forces"),
    ],
)
def test_bad_input_is_named(velocities, forces, named):
    with pytest.raises(InputError, match=named):
        TabulatedFriction(jnp.array(velocities), jnp.array(forces))
