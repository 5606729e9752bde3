"""Derivative-based measures: closed forms, the bound on total effects, both modes, and screening by it."""

import jax.numpy as jnp
import numpy as np
import pytest

from sensitivity import (
    DerivativeMeasures,
    derivative_measures,
    derivative_samples,
    measures_from_derivatives,
    screen,
)
from tests.sensitivity_functions import (
    G_COEFFICIENTS,
    G_FUNCTION,
    ISHIGAMI,
    ISHIGAMI_ST,
    LINEAR,
    SLOPES,
    g_function,
    g_indices,
    ishigami,
    linear,
    linear_indices,
)
from twin._checks import InputError
from twin.parameters import Parameter, ParameterSpace

# E[(∂f/∂x_i)²] of Ishigami, a = 7, b = 0.1, from the moments of cosine and powers over [-π, π].
ISHIGAMI_NU = np.asarray([0.5 * (1 + 0.2 * np.pi**4 / 5 + 0.01 * np.pi**8 / 9), 49 / 2, 0.5 * 16 * 0.01 * np.pi**6 / 7])


def test_ishigami():
    found = derivative_measures(ishigami, ISHIGAMI, seed=1, n=4096)
    np.testing.assert_allclose(found.nu[0], ISHIGAMI_NU * (2 * np.pi) ** 2, rtol=0.01)
    variance = 49 / 8 + 0.1 * np.pi**4 / 5 + 0.01 * np.pi**8 / 18 + 0.5
    np.testing.assert_allclose(found.variance, variance, rtol=0.01)
    np.testing.assert_allclose(found.bound[0], 4 * ISHIGAMI_NU / variance, rtol=0.01)
    assert np.all(found.bound[0] > ISHIGAMI_ST)
    assert np.all(np.abs(found.bound[0] - 4 * ISHIGAMI_NU / variance) < found.bound_conf[0])


def test_g_function():
    """The slope of each factor is ±4/(1 + a_i); the mean square of the others' product is that of Π(1 + part_k)."""
    found = derivative_measures(g_function, G_FUNCTION, seed=1, n=4096)
    part = 1 / (3 * (1 + G_COEFFICIENTS) ** 2)
    expected = 16 / (1 + G_COEFFICIENTS) ** 2 * np.prod(1 + part) / (1 + part)
    np.testing.assert_allclose(found.nu[0], expected, rtol=0.02)
    assert np.all(found.bound[0] >= g_indices()[1])


def test_linear_model_at_a_large_mean():
    """The derivative is exact at every point: no spread, and the bound is 12/π² times the index."""
    found = derivative_measures(linear, LINEAR, seed=1, n=1024)
    np.testing.assert_allclose(found.nu[0], (2 * SLOPES) ** 2, rtol=1e-12)
    np.testing.assert_allclose(found.nu_conf[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(found.bound[0], 12 / np.pi**2 * linear_indices(), rtol=0.01)


def test_the_bound_is_sharp_for_a_cosine():
    """Equality in the Wirtinger inequality: cos(π·u) has a total effect of 1 and a bound of 1."""
    space = ParameterSpace([Parameter("x", "", 0.0, 1.0), Parameter("k", "N/m", 1e3, 1e7, scale="log")])
    found = derivative_measures(lambda x: jnp.cos(jnp.pi * jnp.log10(x[1] / 1e3) / 4), space, seed=2, n=512)
    np.testing.assert_allclose(found.bound[0], [0.0, 1.0], atol=2e-3)


def test_both_modes_agree_and_keep_the_order_of_a_dict():
    def several(x):
        return {"z": ishigami(x), "a": jnp.stack([x[0] * x[1], x[2] ** 2])}

    forward = derivative_measures(several, ISHIGAMI, seed=1, n=64, mode="forward")
    reverse = derivative_measures(several, ISHIGAMI, seed=1, n=64, mode="reverse")
    assert forward.outputs == ("z", "a 0", "a 1")
    np.testing.assert_allclose(forward.nu, reverse.nu, rtol=1e-12, atol=1e-20)
    alone = derivative_measures(ishigami, ISHIGAMI, seed=1, n=64)
    np.testing.assert_allclose(forward.bound[0], alone.bound[0], rtol=1e-12)


def test_a_model_is_differentiated_in_its_parameters():
    model = {"spring": {"k": jnp.asarray(3.0)}, "mass": jnp.asarray(2.0), "name": jnp.asarray(1.0)}
    space = ParameterSpace([Parameter("spring.k", "N/m", 1.0, 9.0, scale="log"), Parameter("mass", "kg", 1.0, 3.0)])

    def frequency(m):
        return jnp.sqrt(m["spring"]["k"] / m["mass"])

    by_model = derivative_measures(frequency, space, model=model, seed=1, n=64)
    by_vector = derivative_measures(lambda x: jnp.sqrt(x[0] / x[1]), space, seed=1, n=64)
    np.testing.assert_allclose(by_model.nu, by_vector.nu, rtol=1e-12)


def test_screening_keeps_what_may_matter_for_one_output():
    def several(x):
        return jnp.stack([x[0] + 1e-3 * x[2], x[1] + 1e-3 * x[2]])

    screening = screen(derivative_measures(several, ISHIGAMI, seed=1, n=64), 0.01)
    assert screening.kept == ("x1", "x2")
    assert screening.left_out == ("x3",)
    assert screening.highest["x3"] == pytest.approx(12 / np.pi**2 * 1e-6, rel=0.3)
    assert ISHIGAMI.subset(screening.kept).paths == ("x1", "x2")


def test_an_output_that_does_not_vary_bounds_nothing():
    found = derivative_measures(lambda x: jnp.stack([0 * x[0] + 0.1, x[1]]), ISHIGAMI, seed=1, n=64)
    assert np.all(found.bound[0] == 0) and found.variance[0] == 0
    assert screen(found).kept == ("x2",)


def test_round_trip(tmp_path):
    found = derivative_measures(ishigami, ISHIGAMI, seed=1, n=64, outputs=["torque"])
    found.save(tmp_path / "measures")
    loaded = DerivativeMeasures.load(tmp_path / "measures")
    assert repr(loaded) == repr(found)
    assert found.to_dataframe().loc[("torque", "x2"), "nu"] == found.nu[0, 1]
    assert "64 points" in found._repr_html_()
    with pytest.raises(InputError, match="No output 'power'"):
        found.index("power")


def test_derivatives_found_elsewhere_give_the_same():
    """Derivatives by the values in SI; a log parameter is uniform, and differentiated, on its own scale."""
    space = ParameterSpace([Parameter("x", "", -1.0, 3.0), Parameter("k", "N/m", 1e3, 1e7, scale="log")])
    samples = derivative_samples(space, 64, seed=3)
    x, k = samples.T
    values = np.stack([x**2 + np.log(k), x * np.sqrt(k)], axis=1)
    derivatives = np.stack([np.stack([2 * x, 1 / k], 1), np.stack([np.sqrt(k), x / np.sqrt(k) / 2], 1)], axis=1)
    found = measures_from_derivatives(space, samples, values, derivatives, seed=3, outputs=["a", "b"])

    def function(v):
        return jnp.stack([v[0] ** 2 + jnp.log(v[1]), v[0] * jnp.sqrt(v[1])])

    traced = derivative_measures(function, space, seed=3, n=64, outputs=["a", "b"])
    assert found.outputs == traced.outputs and found.n == traced.n
    for name in ("variance", "nu", "nu_conf", "bound", "bound_conf"):
        np.testing.assert_allclose(getattr(found, name), getattr(traced, name), rtol=1e-10)
    with pytest.raises(InputError, match="derivatives has the shape"):
        measures_from_derivatives(space, samples, values, derivatives[:, :1], seed=3)
    derivatives[5, 1, 0] = np.nan
    with pytest.raises(InputError, match="The derivative of 'b with respect to x' of sample 5"):
        measures_from_derivatives(space, samples, values, derivatives, seed=3, outputs=["a", "b"])
