"""The logarithm as plain arithmetic."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin._powers import natural_logarithm
from twin.laws.smooth import positive_power, smooth_power


def test_accurate_to_one_unit_in_the_last_place():
    random = np.random.default_rng(3)
    ends = [np.finfo(float).tiny, np.finfo(float).max, np.sqrt(0.5), np.nextafter(np.sqrt(0.5), 0), np.sqrt(2.0)]
    x = np.concatenate([np.exp(random.uniform(-708, 709, 20_000)), 1 + 1e-8 * random.normal(size=5000), ends])
    wanted = np.log(x.astype(np.longdouble))
    found = np.asarray(natural_logarithm(x), np.longdouble)
    changed = x != 1
    assert np.max(np.abs(found - wanted)[changed] / np.spacing(np.abs(np.log(x[changed])))) < 1.0
    assert float(natural_logarithm(jnp.ones(1))[0]) == 0.0


def test_outside_the_positive_numbers():
    odd = jnp.asarray([0.0, -0.0, -1.0, -jnp.inf, jnp.inf, jnp.nan, 1e-310])
    wanted = [-np.inf, -np.inf, np.nan, np.nan, np.inf, np.nan, -np.inf]
    np.testing.assert_array_equal(natural_logarithm(odd), wanted)
    np.testing.assert_array_equal(jax.vmap(natural_logarithm)(odd), wanted)


@pytest.mark.parametrize("x", [1e-300, 0.3, 1.0, 7.0, 1e300])
def test_derivatives_of_any_order_alone_and_in_a_batch(x):
    first, second = jax.grad(natural_logarithm), jax.jacfwd(jax.jacfwd(natural_logarithm))
    assert float(first(x)) == pytest.approx(1 / x, rel=1e-15)
    assert float(jax.vmap(first)(jnp.asarray([x, 2.0]))[0]) == pytest.approx(1 / x, rel=1e-15)
    if 1e-150 < x < 1e150:
        assert float(jax.vmap(second)(jnp.asarray([x, 2.0]))[0]) == pytest.approx(-(x**-2), rel=1e-14)


def test_a_number_alone_is_as_accurate_as_in_a_batch():
    x = np.exp(np.linspace(-30, 30, 101))
    one_by_one = [float(natural_logarithm(v)) for v in x]
    np.testing.assert_allclose(jax.vmap(natural_logarithm)(jnp.asarray(x)), one_by_one, rtol=4e-16)


@pytest.mark.parametrize("exponent", [0.177, 1.0, 2.5])
def test_powers_agree_with_numpy_with_slopes_in_base_and_exponent(exponent):
    x = jnp.asarray(np.exp(np.linspace(-20, 20, 41)))
    np.testing.assert_allclose(positive_power(x, exponent), np.asarray(x) ** exponent, rtol=2e-14)
    slopes = jax.vmap(jax.grad(positive_power, argnums=(0, 1)), in_axes=(0, None))(x, jnp.asarray(exponent))
    np.testing.assert_allclose(slopes[0], exponent * np.asarray(x) ** (exponent - 1), rtol=2e-14)
    np.testing.assert_allclose(slopes[1], np.asarray(x) ** exponent * np.log(x), rtol=2e-13, atol=1e-13)


def test_smooth_power_at_zero_has_no_slope_and_the_curvature_of_its_series():
    width, exponent = 0.1, 0.6

    def power(v):
        return smooth_power(v, width, exponent)

    assert float(power(0.0)) == 0.0
    assert float(jax.grad(power)(0.0)) == 0.0
    assert float(jax.grad(jax.grad(power))(0.0)) == pytest.approx(2 * width ** (exponent - 2), rel=1e-12)
