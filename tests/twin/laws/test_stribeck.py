"""Stribeck friction: its level, its breakaway, and |v|^δ at zero speed."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin._checks import InputError
from twin.laws import CoulombViscousFriction, StribeckFriction, stribeck_level

FC, FS, VS, FV, W = 20.0, 30.0, 0.02, 100.0, 1e-6


@pytest.mark.parametrize("exponent", [0.5, 1.0, 2.0, 3.3])
def test_matches_the_textbook_curve_away_from_zero(exponent):
    law = StribeckFriction(FC, FS, VS, FV, W, exponent)
    v = np.array([-0.3, -0.02, -0.005, 0.005, 0.02, 0.05, 0.3])
    expected = (FC + (FS - FC) * np.exp(-((np.abs(v) / VS) ** exponent))) * np.sign(v) + FV * v
    np.testing.assert_allclose(law(v), expected, rtol=1e-6)


def test_level_runs_from_breakaway_to_coulomb():
    v = jnp.concatenate([jnp.zeros(1), jnp.logspace(-8, 200, 300)])
    level = stribeck_level(v, FC, FS, VS, 2.0, 1e-4)
    assert level[0] == FS
    assert level[-1] == FC
    assert np.all(np.diff(level) <= 0)


@pytest.mark.parametrize("width", [1e-5, 1e-4, 1e-3])
def test_loss_of_breakaway_to_the_width_is_as_documented(width):
    law = StribeckFriction(FC, FS, VS, 0.0, width)
    peak = float(jnp.max(law(jnp.linspace(0.0, VS, 20001))))
    expected = np.sqrt(2 * (1 - FC / FS)) * width / VS
    assert 1 - peak / FS == pytest.approx(expected, rel=0.1)


def test_without_surplus_is_coulomb_viscous():
    v = jnp.linspace(-0.1, 0.1, 31)
    same = StribeckFriction(FC, FC, VS, FV, 1e-3)
    np.testing.assert_allclose(same(v), CoulombViscousFriction(FC, FV, 1e-3)(v), rtol=1e-14)


@jax.jit
@jax.vmap
def _slopes_at_zero(exponent):
    def force(v, d):
        return StribeckFriction(FC, FS, VS, FV, 1e-3, d)(v)

    return jax.grad(force)(0.0, exponent), jax.hessian(force, argnums=(0, 1))(0.0, exponent)


def test_trap_15_power_of_speed_at_zero():
    slope, second = _slopes_at_zero(jnp.array([0.1, 0.5, 1.0, 1.5, 2.0, 7.0]))
    np.testing.assert_allclose(slope, FS / 1e-3 + FV, rtol=1e-12)
    assert np.all(np.isfinite(second))


@jax.jit
@jax.grad
def _by_parameters(parameters, velocity):
    return StribeckFriction(*parameters)(velocity)


@pytest.mark.parametrize("velocity", [1.0, 1e10, -1e300])
def test_no_nan_where_the_exponential_underflows(velocity):
    assert np.all(np.isfinite(_by_parameters(jnp.array([FC, FS, VS, 0.0, 1e-3, 3.0]), velocity)))


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ((30.0, 20.0, VS, FV, W), "static"),
        ((-1.0, 20.0, VS, FV, W), "coulomb"),
        ((FC, FS, 0.0, FV, W), "stribeck_velocity"),
        ((FC, FS, VS, -1.0, W), "viscous"),
        ((FC, FS, VS, FV, 0.0), "width"),
        ((FC, FS, VS, FV, W, 0.0), "exponent"),
    ],
)
def test_bad_input_is_named(arguments, named):
    with pytest.raises(InputError, match=named):
        StribeckFriction(*arguments)
