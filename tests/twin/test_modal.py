"""Undamped modes: closed forms, rigid bodies, elasticities, tracking."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin._checks import InputError
from twin.drives import TwoMass, lumped_elasticities, mauro_axis, screw_elasticities, two_mass_modes
from twin.drives.ball_screw_modes import INERTIAS, STIFFNESSES
from twin.laws import ViscousFriction
from twin.linear import SecondOrder
from twin.modal import elasticities, likeness, modes, track
from twin.paths import get_leaf, set_leaves


def system(mass, stiffness, viscous=None, hysteretic=None):
    n = len(mass)
    zero = np.zeros((n, n))
    viscous, hysteretic = zero if viscous is None else viscous, zero if hysteretic is None else hysteretic
    return SecondOrder(mass, viscous, hysteretic, stiffness, np.eye(n), np.eye(n), ("a",) * n, ("b",) * n)


def two_mass():
    return TwoMass(3e-3, 5e-3, 900.0, 0.02, ViscousFriction(0.0), ViscousFriction(0.0))


def test_two_mass_in_closed_form():
    drive = two_mass()
    found, exact = modes(drive.second_order()), two_mass_modes(drive)
    assert found.frequency[0] == 0.0
    assert np.isclose(found.frequency[1], exact.resonance, rtol=1e-13)
    assert np.isclose(found.damping_ratio[1], exact.damping_ratio, rtol=1e-9)
    assert np.allclose(found.shapes[:, 0], 1 / np.sqrt(8e-3), rtol=1e-12)
    assert found.outputs == ("position", "load_position")


def test_shapes_are_mass_normalised_and_diagonalise():
    found = modes(mauro_axis().second_order())
    mass, stiffness, _ = mauro_axis().matrices()
    assert np.allclose(found.shapes.T @ mass @ found.shapes, np.eye(6), atol=1e-12)
    assert np.allclose(found.shapes.T @ stiffness @ found.shapes, np.diag(found.eigenvalues), atol=1e-5)
    assert np.all(np.max(np.sqrt(np.diag(mass))[:, None] * found.shapes, axis=0) > 0.3)


def test_hysteretic_damping_ratio_is_half_the_loss_factor():
    mass, stiffness, _ = mauro_axis().matrices()
    found = modes(system(mass, stiffness, hysteretic=0.04 * stiffness))
    assert np.allclose(found.damping_ratio[1:], 0.02, rtol=1e-9)
    assert found.damping_ratio[0] == 0.0


def test_rigid_body_mode_has_finite_derivatives():
    """Trap 18: the root of a zero eigenvalue. In both modes of differentiation, through everything that is returned."""

    def everything(k):
        found = modes(set_leaves(mauro_axis(), {"springs.support": k}).second_order())
        return jnp.concatenate([found.frequency, found.damping_ratio, found.eigenvalues, found.shapes.ravel()])

    forward = jax.jit(jax.jacfwd(everything))(4e8)
    backward = jax.jit(jax.jacrev(everything))(4e8)
    assert np.all(np.isfinite(forward))
    assert np.allclose(forward, backward, rtol=1e-6, atol=1e-14)
    assert forward[0] == 0.0
    assert forward[6] == 0.0
    stable = jax.jit(everything)
    difference = (stable(4.004e8) - stable(3.996e8)) / 8e5
    assert np.allclose(forward[1:6], difference[1:6], rtol=1e-5)
    assert np.allclose(forward[18:], difference[18:], rtol=1e-4, atol=1e-12)


def test_second_derivatives():
    def frequency(k):
        return modes(set_leaves(mauro_axis(), {"springs.support": k}).second_order()).frequency

    curvature = jax.jit(jax.jacfwd(jax.jacfwd(frequency)))(4e8)
    slope = jax.jit(jax.jacfwd(frequency))
    assert np.allclose(curvature[1:], (slope(4.001e8) - slope(3.999e8))[1:] / 2e5, rtol=1e-5)
    assert curvature[0] == 0.0


def test_unstable_stiffness_has_no_frequency():
    found = modes(system(np.eye(2), np.diag([-4.0, 9.0])))
    assert np.isnan(found.frequency[0])
    assert np.isclose(found.frequency[1], 3 / (2 * np.pi))
    assert np.isclose(found.eigenvalues[0], -4.0)


def test_modes_refuse():
    with pytest.raises(InputError, match="stiffness matrix is not symmetric"):
        modes(system(np.eye(2), np.array([[2.0, -1.0], [0.0, 2.0]])))
    with pytest.raises(InputError, match="mass matrix is not positive definite"):
        modes(system(np.diag([1.0, 0.0]), np.eye(2)))
    with pytest.raises(InputError, match="viscous matrix has entries"):
        modes(system(np.eye(2), np.eye(2), viscous=np.array([[np.nan, 0.0], [0.0, 1.0]])))
    with pytest.raises(InputError, match="no 'nothing'"):
        screw_elasticities(mauro_axis(), ("springs.nothing",))
    with pytest.raises(InputError, match="No elasticity to 'lead'"):
        screw_elasticities(mauro_axis(), ("slide_mass",))["lead"]


def test_elasticities_in_closed_form_and_by_differences():
    axis = mauro_axis()
    found = screw_elasticities(axis)
    base = modes(axis.second_order())
    bodies = {name: i for i, name in enumerate(INERTIAS)}
    for path in INERTIAS:
        share = base.shapes[bodies[path]] ** 2 * get_leaf(axis, path)
        assert np.allclose(found[path][1:], -0.5 * share[1:], rtol=1e-8, atol=1e-10), path

    @jax.jit
    def log_frequency(path_values):
        return jnp.log(modes(set_leaves(axis, path_values).second_order()).frequency[1:])

    nominal = {path: get_leaf(axis, path) for path in found.paths}
    for path in found.paths:
        at = [log_frequency({**nominal, path: nominal[path] * np.exp(step)}) for step in (-8e-3, -4e-3, 4e-3, 8e-3)]
        slope = (8 * (at[2] - at[1]) - (at[3] - at[0])) / (12 * 4e-3)
        assert np.allclose(found[path][1:], slope, atol=1e-8), path


def test_lumped_elasticities_are_the_strain_energies():
    """k·Δ²/(2λ) of each spring and mode."""
    axis = mauro_axis()
    found, base = lumped_elasticities(axis, nut_position=0.4), modes(axis.second_order(0.4))
    x, h = base.shapes, axis.travel_per_radian
    deformation = np.stack([x[0] - x[1], x[1] - x[2], x[3], x[3] + h * x[2] - x[4], x[4] - x[5]])
    shares = 0.5 * np.stack(axis.stiffness(0.4))[:, None] * deformation**2 / base.eigenvalues
    assert np.allclose(found.values[1:], shares.T[1:], rtol=1e-8, atol=1e-10)
    assert np.all(found.values[0] == 0.0)
    assert found.paths == ("shaft", "torsion", "support", "nut", "flange")


def test_elasticities_of_any_model():
    found = elasticities(two_mass())
    assert np.allclose(found["stiffness"], [0.0, 0.5], atol=1e-12)
    assert np.allclose(found["motor_inertia"] + found["load_inertia"], [0.0, -0.5], atol=1e-12)
    assert np.allclose(found["damping"], 0.0, atol=1e-14)


exponent = st.floats(-1.0, 1.0)


@jax.jit
def _sums(factors):
    axis = mauro_axis()
    paths = (*STIFFNESSES, *INERTIAS, "lead", "nut_position")
    changed = set_leaves(axis, {p: get_leaf(axis, p) * f for p, f in zip(paths, factors, strict=True)})
    found = screw_elasticities(changed)
    split = len(STIFFNESSES)
    stiffness = changed.matrices().stiffness
    mass = jnp.diag(1 / jnp.sqrt(jnp.diag(changed.matrices().mass)))
    return (
        jnp.linalg.eigvalsh(mass @ stiffness @ mass),
        found.frequency,
        found.values[:, :split].sum(axis=1),
        found.values[:, split:].sum(axis=1),
    )


@settings(deadline=None, max_examples=60)
@given(st.lists(exponent, min_size=17, max_size=17))
def test_any_axis_has_one_rigid_body_and_elasticities_that_add_up(exponents):
    """Parameters over two decades each; the nut stays on the screw."""
    factors = 10.0 ** np.array(exponents)
    factors[-1] = min(factors[-1], 1.9)
    values, frequency, stiff, heavy = _sums(factors)
    largest = float(values[-1])
    assert np.abs(values[0]) <= 1e-12 * largest
    assert np.all(values[1:] > 1e-12 * largest)
    assert np.array_equal(frequency == 0, [True] + [False] * 5)
    tolerance = 1e-13 * largest / np.asarray(values[1:]) + 1e-12
    assert np.all(np.abs(stiff[1:] - 0.5) < tolerance)
    assert np.all(np.abs(heavy[1:] + 0.5) < tolerance)


def test_tracking_puts_exchanged_modes_back():
    axis = mauro_axis()
    reference = modes(axis.second_order(0.3))
    found = modes(axis.second_order(1.2))
    order = jnp.array([3, 0, 5, 1, 4, 2])
    mixed = jax.tree.map(lambda x: x[..., order] if x.shape[-1] == 6 else x, found)
    mixed = type(found)(
        mixed.frequency,
        mixed.damping_ratio,
        -mixed.shapes,
        -mixed.output_shapes,
        mixed.eigenvalues,
        found.mass,
        found.outputs,
    )
    back = jax.jit(track)(mixed, reference)
    assert np.array_equal(back.frequency, found.frequency)
    assert np.array_equal(back.shapes, found.shapes)
    assert np.all(np.diag(likeness(back, reference)) > 0.5)
