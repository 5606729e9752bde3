"""Load-dependent stiffness and damping: the printed curves, zero force, derivatives, bad input."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin._checks import InputError
from twin.laws import HyperbolicDamping, RootStiffness

K1, K2 = 1.8709e7, 5.6406
D1, D2, D3 = 9.5376e5, 148.3813, 2.0734e4


def test_curves_are_those_printed_away_from_zero():
    force = np.asarray([-3000.0, -200.0, 200.0, 1000.0, 4000.0])
    np.testing.assert_allclose(RootStiffness(K1, K2)(force), K1 * np.abs(force) ** (1 / K2), rtol=1e-5)
    np.testing.assert_allclose(HyperbolicDamping(D1, D2, D3)(force), D1 / (D2 + np.abs(force)) + D3, rtol=1e-5)


def by_parameters(parameters, force):
    return RootStiffness(*parameters[:3])(force), HyperbolicDamping(*parameters[3:])(force)


@pytest.mark.parametrize("force", [0.0, 1e-12, 1.0, -50.0, 1e9])
def test_trap_15_derivatives_are_finite_at_zero_force_and_agree_with_differences(force):
    values = jnp.asarray([K1, K2, 1.0, D1, D2, D3, 1.0])
    exact = jnp.stack(jax.jit(jax.jacfwd(by_parameters))(values, force))
    evaluate = jax.jit(by_parameters)
    for i, value in enumerate(values):
        step = 1e-5 * value
        up, down = (jnp.stack(evaluate(values.at[i].add(s), force)) for s in (step, -step))
        # Rounding of the difference, in the unit of each law.
        error = np.abs(exact[:, i] - (up - down) / (2 * step)) - 1e-9 * np.abs(up / value)
        assert np.all(error <= 1e-6 * np.abs(exact[:, i]))
    slopes = jax.jit(jax.jacfwd(by_parameters, argnums=1))(values, force)
    assert np.all(np.isfinite(slopes))
    if force == 0.0:
        assert slopes == (0.0, 0.0)


@pytest.mark.parametrize(
    ("law", "arguments", "named"),
    [
        (RootStiffness, (0.0, 5.0), "k1"),
        (RootStiffness, (1e7, -5.0), "k2"),
        (RootStiffness, (1e7, 5.0, 0.0), "width"),
        (HyperbolicDamping, (-1.0, 100.0, 1.0), "d1"),
        (HyperbolicDamping, (1.0, 0.0, 1.0), "d2"),
        (HyperbolicDamping, (1.0, 100.0, float("nan")), "d3"),
    ],
)
def test_bad_input_is_named(law, arguments, named):
    with pytest.raises(InputError, match=named):
        law(*arguments)
