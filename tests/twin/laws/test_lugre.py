"""LuGre friction: steady state, presliding stiffness, dissipation, derivatives at rest and at reversal."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin._checks import InputError
from twin.laws import LuGreFriction, LuGreState, StribeckFriction

W = 1e-4
LAW = LuGreFriction(20.0, 30.0, 0.02, 1e6, 300.0, 100.0, W)


@jax.jit
def _settle(velocity):
    """Integrates the bristles at constant speed by the exact solution of their linear equation."""
    rate_at_zero = LAW.rate(LuGreState(jnp.zeros(())), velocity).deflection
    decay = rate_at_zero - LAW.rate(LuGreState(jnp.ones(())), velocity).deflection
    deflection = rate_at_zero / decay * -jnp.expm1(-decay * 1e3)
    return LAW.force(LuGreState(deflection), velocity, 0.0)


@jax.jit
def _power_balance(deflection, velocity):
    """Power fed in, and growth of the stored energy σ0·z²/2."""
    state = LuGreState(deflection)
    stored = LAW.stiffness * deflection * LAW.rate(state, velocity).deflection
    return LAW.force(state, velocity, 0.0) * velocity, stored


@pytest.mark.parametrize("velocity", [-0.5, -0.01, -1e-5, 1e-6, 1e-3, 0.02, 0.3])
def test_steady_state_is_the_stribeck_curve(velocity):
    stribeck = StribeckFriction(LAW.coulomb, LAW.static, LAW.stribeck_velocity, LAW.viscous, LAW.width)
    assert float(_settle(jnp.array(velocity))) == pytest.approx(float(stribeck(velocity)), rel=1e-12)
    assert LAW.steady_state(velocity) == pytest.approx(float(stribeck(velocity)), rel=1e-14)


def test_is_a_spring_and_damper_before_it_slides():
    v = 1e-3
    assert LAW.force(LAW.initial_state(), v, 0.0) == pytest.approx((300.0 + 100.0) * v, rel=1e-12)
    assert LAW.rate(LAW.initial_state(), v).deflection == pytest.approx(v, rel=1e-12)
    assert LAW.force(LuGreState(jnp.array(1e-6)), 0.0, 0.0) == pytest.approx(1.0, rel=1e-2)


def test_breaks_away_at_the_static_force():
    @jax.jit
    def slow_pull(velocity):
        def step(state, _):
            # Heun's method at constant speed.
            first = LAW.rate(state, velocity).deflection
            second = LAW.rate(LuGreState(state.deflection + 2e-5 * first), velocity).deflection
            after = LuGreState(state.deflection + 1e-5 * (first + second))
            return after, LAW.force(after, velocity, 0.0)

        return jax.lax.scan(step, LAW.initial_state(), length=10_000)[1]

    forces = slow_pull(jnp.array(3e-3))
    assert float(forces[-1]) == pytest.approx(float(LAW.steady_state(3e-3)), rel=1e-6)
    assert float(jnp.max(forces)) == pytest.approx(30.0, rel=0.02)


@given(velocity=st.floats(-0.2, 0.2), share=st.floats(-1.0, 1.0))
@settings(max_examples=50, deadline=None)
def test_dissipates_below_the_passive_speed(velocity, share):
    sigma0, sigma1, sigma2 = 1e6, 300.0, 100.0
    assert abs(velocity) <= 4 * 20.0 * (sigma1 + sigma2) / sigma1**2
    supplied, stored = _power_balance(jnp.array(share * 30.0 / sigma0), jnp.array(velocity))
    assert float(supplied) - float(stored) >= -1e-12 * (1 + abs(float(supplied)))


def test_can_feed_energy_above_the_passive_speed():
    # The bound of the docstring is sharp: at ten times the passive speed some deflection gives energy back.
    velocity = 10 * 4 * 20.0 * 400.0 / 300.0**2
    deflections = jnp.linspace(0.0, 3e-5, 2001)
    supplied, stored = jax.vmap(_power_balance, in_axes=(0, None))(deflections, jnp.array(velocity))
    assert float(jnp.min(supplied - stored)) < 0


def _force_of(parameters, deflection, velocity):
    law = LuGreFriction(*parameters)
    state = LuGreState(deflection)
    return jnp.stack([law.force(state, velocity, 0.0), law.rate(state, velocity).deflection])


_PARAMETERS = jnp.array([20.0, 30.0, 0.02, 1e6, 300.0, 100.0, W, 1.3])
_FORWARD = jax.jit(jax.jacfwd(_force_of, argnums=(0, 1, 2)))
_REVERSE = jax.jit(jax.jacrev(_force_of, argnums=(0, 1, 2)))
_SECOND = jax.jit(jax.hessian(_force_of, argnums=(0, 1, 2)))


@pytest.mark.parametrize("velocity", [0.0, -0.0, 1e-12, 1e-3, -1e-3, 0.4, 1e6])
def test_derivatives_are_finite_at_rest_and_reversal(velocity):
    point = _PARAMETERS, jnp.array(1e-5), jnp.array(velocity)
    forward, reverse = _FORWARD(*point), _REVERSE(*point)
    for a, b in zip(forward, reverse, strict=True):
        assert np.all(np.isfinite(a))
        np.testing.assert_allclose(a, b, rtol=1e-8, atol=1e-9)
    for leaf in jax.tree.leaves(_SECOND(*point)):
        assert np.all(np.isfinite(leaf))


@pytest.mark.parametrize("velocity", [0.0, 5e-5, -1e-3, 0.03])
def test_derivatives_match_central_differences(velocity):
    deflection = jnp.array(1e-5)
    by_parameter, by_deflection, by_velocity = _FORWARD(_PARAMETERS, deflection, jnp.array(velocity))
    for k, value in enumerate(_PARAMETERS):
        h = 1e-6 * float(value)
        up, down = (_force_of(_PARAMETERS.at[k].add(s * h), deflection, velocity) for s in (1, -1))
        np.testing.assert_allclose(by_parameter[:, k], (up - down) / (2 * h), rtol=1e-6, atol=1e-5)
    h = 1e-9
    up, down = (_force_of(_PARAMETERS, deflection, velocity + s * h) for s in (1, -1))
    np.testing.assert_allclose(by_velocity, (up - down) / (2 * h), rtol=1e-4)
    up, down = (_force_of(_PARAMETERS, deflection + s * h, velocity) for s in (1, -1))
    np.testing.assert_allclose(by_deflection, (up - down) / (2 * h), rtol=1e-6)


@pytest.mark.parametrize(
    ("position", "value", "named"),
    [
        (0, 0.0, "coulomb"),
        (1, 10.0, "static"),
        (2, 0.0, "stribeck_velocity"),
        (3, 0.0, "stiffness"),
        (4, -1.0, "damping"),
        (5, np.nan, "viscous"),
        (6, 0.0, "width"),
        (7, -1.0, "exponent"),
    ],
)
def test_bad_input_is_named(position, value, named):
    arguments = [float(p) for p in _PARAMETERS]
    arguments[position] = value
    with pytest.raises(InputError, match=named):
        LuGreFriction(*arguments)
