"""Dahl friction: hysteresis over a displacement, its steady state, and derivatives at awkward points."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin._checks import InputError
from twin.laws import ConstantForce, DahlFriction, DahlState

LAW = DahlFriction(
    coulomb=20.0, viscous=200.0, displacement=1e-4, asymmetry=-30.0, rise=5.0, rise_velocity=0.02, width=1e-6
)


def _walk(speed, distance, start, steps=4000):
    """z after a distance at constant speed, by small explicit steps."""
    dt = distance / abs(speed) / steps
    rate = jax.jit(lambda z: LAW.rate(DahlState(z), jnp.asarray(speed)).direction)
    return float(jax.lax.fori_loop(0, steps, lambda _, z: z + dt * rate(z), jnp.asarray(start)))


@pytest.mark.parametrize(("speed", "start"), [(1e-3, 0.0), (1e-3, -1.0), (-1e-3, 1.0), (-1e-3, 0.3)])
def test_turns_around_over_its_displacement(speed, start):
    """z approaches the direction of motion as exp(-distance/δ), whatever the speed."""
    for distance in (0.5e-4, 1e-4, 5e-4):
        expected = np.sign(speed) + (start - np.sign(speed)) * np.exp(-distance / 1e-4)
        assert _walk(speed, distance, start) == pytest.approx(expected, abs=1e-3)


def test_fast_motion_turns_no_faster_than_the_rate_limit():
    rates = LAW.rate(DahlState(jnp.zeros(3)), jnp.array([1e-9, 10.0, -1e6])).direction
    assert float(rates[0]) == pytest.approx(1e-9 / 1e-4)
    np.testing.assert_allclose(rates[1:], [3000.0, -3000.0], rtol=1e-3)


@pytest.mark.parametrize("speed", [0.3, 0.01, -0.01, -0.3])
def test_sliding_force(speed):
    direction = np.sign(speed)
    force = LAW.force(DahlState(jnp.asarray(direction)), speed, 0.0)
    level = 20 + 5 * (1 - np.exp(-abs(speed) / 0.02)) + (200 - 30 * direction) * abs(speed)
    assert float(force) == pytest.approx(direction * level, rel=1e-6)
    assert float(LAW.level(jnp.asarray(abs(speed)))) == pytest.approx(level + 30 * direction * abs(speed), rel=1e-9)
    assert float(LAW.rate(DahlState(jnp.asarray(direction)), speed).direction) == pytest.approx(0.0, abs=0.05)


def test_the_variation_acts_against_motion_in_both_directions():
    varied = DahlFriction(20.0, 0.0, 1e-4, variation=ConstantForce(3.0))
    for z in (1.0, -1.0, 0.5):
        assert float(varied.force(DahlState(jnp.asarray(z)), z, 0.0)) == pytest.approx(23.0 * z, rel=1e-6)


def test_no_force_at_rest_without_load():
    assert float(LAW.force(LAW.initial_state(), 0.0, 0.0)) == 0.0
    assert float(LAW.rate(LAW.initial_state(), 0.0).direction) == 0.0


@pytest.mark.parametrize("speed", [0.0, -0.0, 1e-9, -1e-9, 0.3, -0.3, 1e6, -1e6])
@pytest.mark.parametrize("z", [0.0, 1.0, -1.0])
def test_derivatives_are_finite(speed, z):
    def both(law, z, speed):
        return jnp.stack([law.rate(DahlState(z), speed).direction, law.force(DahlState(z), speed, 0.0)])

    arguments = (LAW, jnp.asarray(z), jnp.asarray(speed))
    forward = jax.jacfwd(both, argnums=(0, 1, 2))(*arguments)
    reverse = jax.jacrev(both, argnums=(0, 1, 2))(*arguments)
    for a, b in zip(jax.tree.leaves(forward), jax.tree.leaves(reverse), strict=True):
        assert np.all(np.isfinite(a))
        np.testing.assert_allclose(a, b, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"coulomb": -1.0}, "coulomb"),
        ({"viscous": np.nan}, "viscous"),
        ({"displacement": 0.0}, "displacement"),
        ({"asymmetry": np.inf}, "asymmetry"),
        ({"rise_velocity": -1.0}, "rise_velocity"),
        ({"rate_limit": 0.0}, "rate_limit"),
        ({"width": 0.0}, "width"),
        ({"initial_direction": 1.5}, "initial_direction must lie between -1 and 1, but is 1.5"),
    ],
)
def test_bad_input_is_named(change, named):
    with pytest.raises(InputError, match=named):
        DahlFriction(**{"coulomb": 20.0, "viscous": 1.0, "displacement": 1e-4, **change})
