"""What all friction laws without memory have in common, and known values of each."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin._checks import InputError
from twin.laws import (
    AbstractStaticFriction,
    AsymmetricFriction,
    CoulombFriction,
    CoulombViscousFriction,
    StribeckFriction,
    TabulatedFriction,
    ViscousFriction,
)

W = 1e-3
TABLE = jnp.array([-0.5, -0.1, -0.01, 0.0, 0.01, 0.1, 0.5])
LAWS = {
    "viscous": ViscousFriction(200.0),
    "coulomb": CoulombFriction(20.0, W),
    "coulomb_viscous": CoulombViscousFriction(20.0, 200.0, W),
    "asymmetric": AsymmetricFriction(20.0, 25.0, 200.0, 150.0, W),
    "stribeck": StribeckFriction(20.0, 30.0, 0.02, 200.0, W),
    "stribeck_sharp": StribeckFriction(20.0, 30.0, 0.02, 200.0, W, exponent=0.5),
    "tabulated": TabulatedFriction(TABLE, jnp.array([-60.0, -25.0, -30.0, 0.0, 30.0, 25.0, 60.0])),
}
SYMMETRIC = [name for name in LAWS if name != "asymmetric"]


@eqx.filter_jit
def _force(law, velocity):
    return law(velocity)


@eqx.filter_jit
def _derivatives(law, velocity):
    parameters, rest = eqx.partition(law, eqx.is_array)

    def force(parameters, velocity):
        return eqx.combine(parameters, rest)(velocity)

    forward = jax.jacfwd(force, argnums=(0, 1))(parameters, velocity)
    reverse = jax.jacrev(force, argnums=(0, 1))(parameters, velocity)
    return forward, reverse, jax.jacfwd(jax.jacrev(force, argnums=(0, 1)), argnums=1)(parameters, velocity)


@pytest.mark.parametrize("name", LAWS)
def test_is_memoryless_and_broadcasts(name):
    law = LAWS[name]
    assert isinstance(law, AbstractStaticFriction)
    assert law.initial_state() == () and law.rate((), 0.1) == ()
    assert float(law.force((), 0.1, 0.0)) == pytest.approx(float(law(0.1)), rel=1e-15)
    velocities = jnp.linspace(-0.6, 0.6, 12).reshape(3, 4)
    one_by_one = [float(_force(law, v)) for v in velocities.ravel()]
    np.testing.assert_allclose(_force(law, velocities).ravel(), one_by_one, rtol=1e-14)


@pytest.mark.parametrize("name", LAWS)
def test_no_force_at_rest(name):
    assert abs(float(LAWS[name](0.0))) == 0


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("velocity", [0.0, -0.0, 1e-9, -1e-9, 0.3, -0.3, 0.1, 1e3, -1e200])
def test_derivatives_are_finite(name, velocity):
    forward, reverse, second = _derivatives(LAWS[name], jnp.array(velocity))
    for leaf in jax.tree.leaves((forward, reverse, second)):
        assert np.all(np.isfinite(leaf))
    for a, b in zip(jax.tree.leaves(forward), jax.tree.leaves(reverse), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("velocity", [0.0, 5e-4, -5e-4, 0.02, -0.3, 0.7])
def test_derivatives_match_central_differences(name, velocity):
    law = LAWS[name]
    (parameter_slopes, slope), _, _ = _derivatives(law, jnp.array(velocity))
    h = 1e-9
    difference = (_force(law, jnp.array(velocity + h)) - _force(law, jnp.array(velocity - h))) / (2 * h)
    assert slope == pytest.approx(float(difference), rel=1e-4, abs=1e-3)
    leaves, structure = jax.tree.flatten(law)
    for k, (leaf, derivative) in enumerate(zip(leaves, jax.tree.leaves(parameter_slopes), strict=True)):
        for index in np.ndindex(leaf.shape):
            step = 1e-6 * max(abs(float(leaf[index])), W)
            up = jax.tree.unflatten(structure, [*leaves[:k], leaf.at[index].add(step), *leaves[k + 1 :]])
            down = jax.tree.unflatten(structure, [*leaves[:k], leaf.at[index].add(-step), *leaves[k + 1 :]])
            difference = (_force(up, jnp.array(velocity)) - _force(down, jnp.array(velocity))) / (2 * step)
            assert derivative[index] == pytest.approx(float(difference), rel=1e-5, abs=1e-4)


@pytest.mark.parametrize("name", LAWS)
@given(velocity=st.floats(-2.0, 2.0))
@settings(max_examples=30, deadline=None)
def test_never_drives(name, velocity):
    # A table's force at zero speed is zero but for the rounding of its polynomial.
    assert np.sign(velocity) * float(_force(LAWS[name], jnp.array(velocity))) >= -1e-13


@pytest.mark.parametrize("name", SYMMETRIC)
@given(velocity=st.floats(0.0, 2.0))
@settings(max_examples=30, deadline=None)
def test_symmetric_laws_are_odd(name, velocity):
    forward = float(_force(LAWS[name], jnp.array(velocity)))
    assert forward == pytest.approx(-float(_force(LAWS[name], jnp.array(-velocity))), rel=1e-13, abs=1e-13)


def test_known_values():
    assert LAWS["viscous"](-0.5) == -100
    assert LAWS["coulomb"](W) == pytest.approx(20 / np.sqrt(2), rel=1e-14)
    assert LAWS["coulomb"](1.0) == pytest.approx(20, rel=1e-6)
    assert LAWS["coulomb_viscous"](-1.0) == pytest.approx(-220, rel=1e-6)


def test_asymmetric_has_each_directions_own_coefficients():
    assert LAWS["asymmetric"](1.0) == pytest.approx(20 + 200, rel=1e-5)
    assert LAWS["asymmetric"](-1.0) == pytest.approx(-25 - 150, rel=1e-5)


def test_asymmetric_with_equal_directions_is_coulomb_viscous():
    velocities = jnp.linspace(-0.01, 0.01, 21)
    equal = AsymmetricFriction(20.0, 20.0, 200.0, 200.0, W)
    np.testing.assert_allclose(equal(velocities), LAWS["coulomb_viscous"](velocities), rtol=1e-14)


def test_a_batch_of_laws_under_vmap():
    laws = jax.vmap(lambda level: CoulombFriction(level, W))(jnp.array([1.0, 2.0, 3.0]))
    forces = jax.vmap(lambda law: law(1.0))(laws)
    np.testing.assert_allclose(forces, [1, 2, 3], rtol=1e-6)


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: ViscousFriction(-1.0), "viscous"),
        (lambda: ViscousFriction(np.nan), "viscous"),
        (lambda: CoulombFriction(-1.0, W), "coulomb"),
        (lambda: CoulombFriction(1.0, 0.0), "width"),
        (lambda: CoulombViscousFriction(1.0, -1.0, W), "viscous"),
        (lambda: AsymmetricFriction(1.0, -1.0, 1.0, 1.0, W), "coulomb_negative"),
        (lambda: AsymmetricFriction(1.0, 1.0, 1.0, np.inf, W), "viscous_negative"),
    ],
)
def test_bad_input_is_named(make, named):
    with pytest.raises(InputError, match=named):
        make()
