"""Motoring energy: closed forms, crossings between samples, derivatives, and what must not hide."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jaxtyping import TypeCheckError

from twin._checks import InputError
from twin.performance import motoring_energy

T = np.array([0.0, 0.1, 0.25, 0.3, 0.7, 1.0])
POWERS = st.lists(st.floats(-100.0, 100.0), min_size=T.size, max_size=T.size).map(np.array)


def fine(values, points=200_001):
    """Straight lines between samples, sampled finely."""
    grid = np.linspace(T[0], T[-1], points)
    return grid, np.interp(grid, T, values)


_ENERGY = jax.jit(motoring_energy)
_DRAGGED = jax.jit(lambda p, m: motoring_energy(T, p, dragged=m))
_SMOOTH = jax.jit(lambda p, w: motoring_energy(T, p, width=w))


def test_ramp_through_zero_is_exact():
    # From -1 to 3 W in 2 s: a triangle of 3 W over 1.5 s.
    assert float(motoring_energy(np.array([0.0, 2.0]), np.array([-1.0, 3.0]))) == pytest.approx(2.25, rel=1e-15)
    assert float(motoring_energy(np.array([0.0, 2.0]), np.array([3.0, -1.0]))) == pytest.approx(2.25, rel=1e-15)
    assert float(motoring_energy(np.array([0.0, 2.0]), np.array([-3.0, -1.0]))) == 0.0


@given(POWERS)
@settings(max_examples=30, deadline=None)
def test_agrees_with_a_fine_sum(power):
    grid, p = fine(power)
    assert float(_ENERGY(T, power)) == pytest.approx(np.trapezoid(np.maximum(p, 0), grid), rel=1e-6, abs=1e-6)


@given(POWERS, POWERS)
@settings(max_examples=30, deadline=None)
def test_the_shaft_decides_where_it_is_given(power, shaft):
    (grid, p), (_, m) = fine(power), fine(shaft)
    expected = np.trapezoid(np.where(m >= 0, p, 0.0), grid)
    # One cell of the grid at each of five crossings is what the fine sum can be off by.
    assert float(_DRAGGED(power, shaft)) == pytest.approx(expected, abs=5 * 100 * 5e-6 + 1e-9)


@given(POWERS)
@settings(max_examples=20, deadline=None)
def test_power_as_its_own_judge_is_the_same(power):
    assert float(_DRAGGED(power, power)) == pytest.approx(float(_ENERGY(T, power)), rel=1e-12, abs=1e-12)


def test_smooth_twin_approaches_the_sharp_one_with_the_square_of_its_width():
    power = np.array([5.0, -3.0, 2.0, -8.0, -1.0, 4.0])
    off = [abs(float(_SMOOTH(power, w) - _ENERGY(T, power))) for w in (0.2, 0.1, 0.05)]
    assert off[0] < 0.02
    # w²·ln(1/w) at a crossing.
    assert off[0] / off[1] > 2.5 and off[1] / off[2] > 2.5


def test_rest_takes_no_energy_and_holding_counts():
    assert float(_SMOOTH(np.zeros(T.size), 10.0)) == 0.0
    holding = motoring_energy(T, np.full(T.size, 7.0), dragged=np.zeros(T.size))
    assert float(holding) == pytest.approx(7.0, rel=1e-14)
    assert float(motoring_energy(T, np.full(T.size, 7.0), dragged=np.zeros(T.size), width=1.0)) == pytest.approx(
        7.0, rel=3e-3
    )


@pytest.mark.parametrize("kind", ["sharp", "dragged", "smooth", "smooth dragged"])
@pytest.mark.parametrize("power", [[5.0, -3.0, 2.0, 8.0, -1.0, 4.0], [0.0, 4.0, 0.0, -3.0, 0.0, 2.0]])
def test_derivatives_agree_with_central_differences(kind, power):
    shaft = np.array([4.0, -4.0, 1.5, 7.0, 3.0, -1.0])

    @jax.jit
    def energy(x):
        p, m = x[:6], x[6:]
        width = 0.5 if "smooth" in kind else None
        return motoring_energy(T, p, dragged=m if "dragged" in kind else None, width=width)

    x = jnp.concatenate([jnp.array(power), shaft])
    forward, backward = jax.jit(jax.jacfwd(energy))(x), jax.jit(jax.jacrev(energy))(x)
    np.testing.assert_allclose(forward, backward, rtol=1e-12, atol=1e-13)
    for i in range(x.size):
        step = jnp.zeros(x.size).at[i].set(1e-5)
        numeric = float(energy(x + step) - energy(x - step)) / 2e-5
        assert float(forward[i]) == pytest.approx(numeric, rel=2e-5, abs=2e-6)


def test_at_rest_the_derivative_is_finite():
    for width in (None, 1.0):
        slope = jax.jacfwd(lambda p, width=width: motoring_energy(T, p, width=width))(jnp.zeros(T.size))
        assert np.all(np.isfinite(slope))
    assert np.all(np.isfinite(jax.jacfwd(lambda m: motoring_energy(T, T, dragged=m))(jnp.zeros(T.size))))


@pytest.mark.parametrize("where", [0, 2, 5])
def test_nan_does_not_hide(where):
    """Trap 9: a failed run is NaN, and max(NaN, 0) must not make it a number."""
    power = np.full(T.size, -1.0)
    power[where] = np.nan
    assert np.isnan(motoring_energy(T, power))
    assert np.isnan(motoring_energy(T, np.ones(T.size), dragged=power))
    assert np.isnan(motoring_energy(T, power, width=1.0))


def test_maps_over_runs():
    powers = np.array([[1.0] * 6, [-1.0] * 6, [0.0] * 6])
    np.testing.assert_allclose(jax.vmap(lambda p: motoring_energy(T, p))(powers), [1.0, 0.0, 0.0], atol=1e-15)


@pytest.mark.parametrize(
    ("times", "power", "width", "named"),
    [
        (T[::-1].copy(), T, None, "times"),
        (T[:1], T[:1], None, "times"),
        (T, T[:3], None, "power"),
        (T, T, -1.0, "width"),
        (T, T, 0.0, "width"),
    ],
)
def test_bad_input_is_named(times, power, width, named):
    # Where annotations are checked, they refuse shapes that differ before the message can.
    with pytest.raises((InputError, TypeCheckError), match=named):
        motoring_energy(times, power, width=width)
