"""Static error: window between samples, sign, hunting about the target, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin._checks import InputError
from twin.performance import static_error

T = np.array([0.0, 0.1, 0.25, 0.3, 0.7, 1.0])


@given(st.lists(st.floats(-2.0, 2.0), min_size=6, max_size=6), st.floats(0.01, 1.0))
@settings(max_examples=30, deadline=None)
def test_agrees_with_a_fine_mean(position, window):
    grid = np.linspace(1 - window, 1.0, 20_001)
    error = 0.5 - np.interp(grid, T, position)
    found = static_error(T, np.array(position), 0.5, window)
    assert float(found.signed) == pytest.approx(np.trapezoid(error, grid) / window, abs=1e-6)
    assert float(found.absolute) == pytest.approx(np.trapezoid(np.abs(error), grid) / window, abs=1e-6)
    assert abs(float(found.signed)) <= float(found.absolute) + 1e-12


def test_sign_and_moving_target():
    found = static_error(T, T - 0.01, T, 0.5)
    np.testing.assert_allclose(found, [0.01, 0.01], rtol=1e-12)
    np.testing.assert_allclose(static_error(T, T + 0.01, T, 0.5), [-0.01, 0.01], rtol=1e-12)


def test_smooth_magnitude():
    found = static_error(T, np.full(6, 1.0), 1.3, 0.4, width=0.4)
    np.testing.assert_allclose(found, [0.3, 0.5], rtol=1e-12)


@pytest.mark.parametrize("width", [None, 0.1])
def test_derivatives_agree_with_central_differences(width):
    @jax.jit
    def errors(x):
        return jnp.stack(static_error(T, x[:6], x[6], x[7], width=width))

    x = jnp.array([0.3, -0.2, 0.9, 0.4, 0.6, 0.35, 0.5, 0.62])
    exact = jax.jit(jax.jacfwd(errors))(x)
    np.testing.assert_allclose(exact, jax.jit(jax.jacrev(errors))(x), rtol=1e-11, atol=1e-13)
    for i in range(x.size):
        step = jnp.zeros(x.size).at[i].set(1e-6)
        numeric = (errors(x + step) - errors(x - step)) / 2e-6
        np.testing.assert_allclose(exact[:, i], numeric, rtol=1e-6, atol=1e-8)


def test_exactly_on_target_is_finite():
    slope = jax.jacfwd(lambda x: jnp.stack(static_error(T, x, 1.0, 0.5)))(jnp.ones(6))
    assert np.all(np.isfinite(slope))


def test_nan_and_long_windows_are_marked():
    assert np.isnan(static_error(T, np.array([0, 0, 0, 0, 0, np.nan]), 1.0, 0.1).absolute)
    windows = jax.vmap(lambda w: static_error(T, T, 1.0, w).signed)(jnp.array([0.5, 1.0, 1.5]))
    np.testing.assert_allclose(windows, [0.25, 0.5, np.nan])


@pytest.mark.parametrize("window", [0.0, -1.0, 1.1, np.inf])
def test_bad_windows_are_named(window):
    with pytest.raises(InputError, match="window"):
        static_error(T, T, 1.0, window)
