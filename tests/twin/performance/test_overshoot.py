"""Overshoot against the closed form of a second-order step."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin._checks import InputError
from twin.performance import overshoot

T = jnp.linspace(0.0, 1.0, 201)


def step_response(damping, omega=20.0):
    s, d = damping * omega, omega * jnp.sqrt(1 - damping**2)
    return 1 - jnp.exp(-s * T) * (jnp.cos(d * T) + s / d * jnp.sin(d * T))


@pytest.mark.parametrize("damping", [0.1, 0.3, 0.6])
def test_closed_form(damping):
    exact = np.exp(-np.pi * damping / np.sqrt(1 - damping**2))
    x = step_response(damping)
    assert float(overshoot(T, x, 1.0)) == pytest.approx(exact, abs=1e-5)
    assert float(overshoot(T, 5 - 2 * x, 3.0, start=5.0)) == pytest.approx(exact, abs=1e-5)
    smooth = float(overshoot(T, x, 1.0, width=1e-3))
    highest = float(jnp.max(x) - 1)
    assert highest <= smooth <= highest + 1e-3 * np.log(202)


def test_none_is_zero_and_a_failed_run_is_marked():
    assert float(overshoot(T, 0.9 * T, 1.0)) == 0.0
    assert float(overshoot(T, T, 1.0)) == 0.0
    assert np.isnan(overshoot(T, T.at[3].set(jnp.nan), 1.0))
    assert np.isnan(overshoot(T, T.at[3].set(jnp.nan), 1.0, width=0.1))
    assert float(overshoot(T[:2], jnp.array([0.0, 1.5]), 1.0)) == pytest.approx(0.5)


@pytest.mark.parametrize("width", [None, 0.01])
def test_derivative(width):
    @jax.jit
    def found(damping):
        return overshoot(T, step_response(damping), 1.0, start=0.0, width=width)

    at = jnp.asarray(0.3)
    exact = jax.jit(jax.grad(found))(at)
    assert float(exact) == pytest.approx(float(jax.jvp(found, (at,), (jnp.ones(()),))[1]), rel=1e-12)
    assert float(exact) == pytest.approx(float(found(at + 1e-6) - found(at - 1e-6)) / 2e-6, rel=1e-6)
    if width is None:
        closed = jax.grad(lambda d: jnp.exp(-jnp.pi * d / jnp.sqrt(1 - d**2)))(at)
        assert float(exact) == pytest.approx(float(closed), rel=1e-3)


def test_bad_input_is_named():
    with pytest.raises(InputError, match="no travel"):
        overshoot(T, T, 0.0)
    with pytest.raises(InputError, match="width"):
        overshoot(T, T, 1.0, width=-1.0)
