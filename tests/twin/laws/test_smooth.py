"""The smooth sign, magnitude and power: values, derivatives, and the places where sharp ones break."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin.laws import positive_power, smooth_abs, smooth_power, smooth_sign


def _half_power(value, width):
    return smooth_power(value, width, 0.5)


FUNCTIONS = [smooth_sign, smooth_abs, _half_power]
AWKWARD = [0.0, -0.0, 1e-300, 1e-3, -1e-3, 1.0, -1e20, 0.9e47, 1.1e47, 1e150, -1e250, 1e300]
_FIRST = {f: jax.jit(jax.vmap(jax.grad(f, argnums=(0, 1)), in_axes=(0, None))) for f in FUNCTIONS}
_SECOND = {f: jax.jit(jax.vmap(jax.hessian(f, argnums=(0, 1)), in_axes=(0, None))) for f in FUNCTIONS}


def test_known_values():
    assert smooth_sign(1.0, 1.0) == pytest.approx(1 / np.sqrt(2), rel=1e-15)
    assert smooth_sign(0.0, 1e-3) == 0
    assert smooth_abs(3.0, 4.0) == pytest.approx(5.0, rel=1e-15)
    assert smooth_abs(0.0, 1e-3) == 1e-3
    assert smooth_power(0.0, 1e-3, 0.5) == 0
    assert smooth_power(2.0, 1e-9, 0.5) == pytest.approx(np.sqrt(2.0), rel=1e-15)


@pytest.mark.parametrize("function", FUNCTIONS)
def test_derivatives_are_finite_everywhere(function):
    values = jnp.array(AWKWARD)
    assert np.all(np.isfinite(_FIRST[function](values, 1e-3)))
    assert np.all(np.isfinite(_SECOND[function](values, 1e-3)))


@pytest.mark.parametrize("function", FUNCTIONS)
def test_derivatives_match_central_differences(function):
    values, width, h = jnp.array([0.0, 3e-4, -2e-3, 0.5]), 1e-3, 1e-8
    by_value, by_width = _FIRST[function](values, width)
    difference = (function(values + h, width) - function(values - h, width)) / (2 * h)
    np.testing.assert_allclose(by_value, difference, rtol=1e-7, atol=1e-7)
    difference = (function(values, width + h) - function(values, width - h)) / (2 * h)
    np.testing.assert_allclose(by_width, difference, rtol=1e-7, atol=1e-7)


def test_derivative_with_respect_to_the_width_keeps_its_digits_far_from_zero():
    slope = jax.grad(smooth_abs, argnums=1)(1e3, 1e-6)
    assert float(slope) == pytest.approx(1e-9, rel=1e-12)


def test_limits_at_infinity():
    assert smooth_sign(np.inf, 1e-3) == 1
    assert smooth_sign(-1e308, 1e-3) == -1
    assert smooth_abs(-1e308, 1e-3) == 1e308
    assert np.isnan(smooth_sign(np.nan, 1e-3))


@given(st.floats(-1e6, 1e6), st.floats(1e-9, 1e3))
@settings(max_examples=50, deadline=None)
def test_sign_times_magnitude_is_the_value(value, width):
    sign, magnitude = float(smooth_sign(value, width)), float(smooth_abs(value, width))
    assert sign * magnitude == pytest.approx(value, rel=1e-14, abs=1e-300)
    assert abs(sign) <= 1
    assert magnitude >= width * (1 - 1e-15)
    assert smooth_sign(-value, width) == -sign


@pytest.mark.parametrize("exponent", [0.3, 1.0, 2.0, 5.0])
def test_power_increases_with_magnitude(exponent):
    values = jnp.linspace(0.0, 10.0, 200)
    assert np.all(np.diff(smooth_power(values, 1.0, exponent)) > 0)


@pytest.mark.parametrize("exponent", [-1.7, 0.0, 0.17, 1.0, 2.3])
@pytest.mark.parametrize("base", [1e-12, 0.3, 1.0, 4.7e9])
def test_positive_power_is_the_power_with_both_derivatives(base: float, exponent: float):
    np.testing.assert_allclose(positive_power(jnp.asarray(base), exponent), base**exponent, rtol=2e-14)
    by_base, by_exponent = jax.grad(positive_power, argnums=(0, 1))(jnp.asarray(base), jnp.asarray(exponent))
    np.testing.assert_allclose(by_base, exponent * base ** (exponent - 1), rtol=1e-13)
    np.testing.assert_allclose(by_exponent, np.log(base) * base**exponent, rtol=1e-13)
