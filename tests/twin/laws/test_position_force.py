"""Forces that depend on the position."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin._checks import InputError
from twin.laws import ConstantForce, HarmonicForce, NoForce, PolynomialForce

COSINE, SINE = jnp.array([1.0, 0.0, 0.5]), jnp.array([0.3, -2.0, 0.0])
HARMONIC = HarmonicForce(0.01, COSINE, SINE)
FORCES = [
    NoForce(),
    ConstantForce(12.0),
    HARMONIC,
    PolynomialForce(jnp.array([1.0, -2.0, 0.5, 3.0]), centre=0.2, span=0.5),
]


@pytest.mark.parametrize("law", FORCES)
def test_broadcasts(law):
    x = jnp.linspace(-1.0, 1.0, 6).reshape(2, 3)
    force = law(x)
    assert force.shape == x.shape
    np.testing.assert_allclose(force.ravel(), jax.vmap(law)(x.ravel()), rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("law", FORCES)
def test_repeated_derivatives(law):
    x, h = jnp.array([0.0, 0.2, -0.7]), 1e-7
    lower = law
    for _ in range(3):
        derivative = jax.jit(jax.vmap(jax.grad(lower)))
        below = jax.jit(jax.vmap(lower))
        difference = (below(x + h) - below(x - h)) / (2 * h)
        np.testing.assert_allclose(derivative(x), difference, rtol=1e-4, atol=1e-4 * np.max(np.abs(difference)))
        lower = jax.grad(lower)


def test_harmonics_repeat_with_the_period():
    x = jnp.linspace(0.0, 0.01, 13)
    np.testing.assert_allclose(HARMONIC(x + 0.05), HARMONIC(x), atol=1e-12)
    assert HARMONIC(0.0) == pytest.approx(1.5)
    assert HARMONIC(0.0025) == pytest.approx(0.3)
    assert float(jnp.mean(HARMONIC(x[:-1]))) == pytest.approx(0.0, abs=1e-13)


def test_polynomial_is_in_scaled_position():
    law = FORCES[3]
    x = jnp.linspace(-0.3, 0.7, 7)
    np.testing.assert_allclose(law(x), np.polynomial.polynomial.polyval((x - 0.2) / 0.5, [1.0, -2.0, 0.5, 3.0]))


def test_parameters_are_differentiable_at_the_centre():
    def force(coefficients, centre, span):
        return PolynomialForce(coefficients, centre, span)(0.2)

    by_coefficients, by_centre, by_span = jax.grad(force, argnums=(0, 1, 2))(jnp.array([1.0, -2.0, 0.5]), 0.2, 0.5)
    np.testing.assert_allclose(by_coefficients, [1, 0, 0])
    assert by_centre == pytest.approx(4.0) and by_span == 0


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: ConstantForce(np.inf), "constant"),
        (lambda: HarmonicForce(0.0, COSINE, SINE), "period"),
        (lambda: HarmonicForce(0.01, COSINE, SINE[:2]), "cosine and sine"),
        (lambda: HarmonicForce(0.01, COSINE, jnp.array([0.0, np.nan, 0.0])), "sine"),
        (lambda: HarmonicForce(0.01, jnp.array(1.0), jnp.array(1.0)), "cosine"),
        (lambda: PolynomialForce(jnp.zeros(0)), "coefficients"),
        (lambda: PolynomialForce(COSINE, 0.0, -1.0), "span"),
    ],
)
def test_bad_input_is_named(make, named):
    with pytest.raises(InputError, match=named):
        make()
