"""Mauro et al.: matrices 18 as second derivatives of energies, and what is published on the modes."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin.drives import SpringDampers, mauro_axis, spring_deformations, structural_damping
from twin.drives.mauro import HALF_STROKE
from twin.modal import modes

# θ₁, θ₂, θ₃, x₀, x₂, x₃
POINT = jnp.zeros(6)


def _springs(x, h):
    x1 = x[3] + h * x[2]
    return jnp.stack([x[0] - x[1], x[1] - x[2], x[3], x1 - x[4], x[4] - x[5]])


def _assembled(axis, distance):
    """M, K and B as Hessians of kinetic energy, elastic energy and Rayleigh's dissipation, from single parts."""
    p, h = axis.springs, 0.02 / (2 * np.pi)
    stiffness = jnp.stack(
        [
            p.motor_shaft * p.coupling / (p.motor_shaft + p.coupling),
            p.screw_end / (1 + p.screw_end * distance / p.screw.torsional_rigidity),
            p.support / (1 + p.support / p.bearing + p.support * distance / p.screw.axial_rigidity),
            p.nut,
            p.flange,
        ]
    )
    damping = axis.damping
    if isinstance(damping, SpringDampers):
        viscous = jnp.stack([damping.shaft, damping.torsion, damping.support, damping.nut, damping.flange])
    else:
        viscous = damping.time * stiffness

    def kinetic(v):
        rotating = axis.motor_inertia * v[0] ** 2 + axis.end_inertia * v[1] ** 2 + axis.screw_inertia * v[2] ** 2
        moving = axis.screw_mass * v[3] ** 2 + axis.nut_mass * v[4] ** 2 + axis.slide_mass * v[5] ** 2
        return 0.5 * (rotating + moving)

    hessian = jax.hessian
    return (
        hessian(kinetic)(POINT),
        hessian(lambda x: 0.5 * jnp.sum(stiffness * _springs(x, h) ** 2))(POINT),
        hessian(lambda v: 0.5 * jnp.sum(viscous * _springs(v, h) ** 2))(POINT),
    )


@pytest.mark.parametrize("damping", [None, (3.0, 2.0, 4e4, 3e4, 2e4)])
@pytest.mark.parametrize("distance", [None, 0.25, 1.2])
def test_matrices_entry_by_entry(damping, distance):
    axis = mauro_axis()
    if damping is not None:
        axis = eqx.tree_at(lambda a: a.damping, axis, SpringDampers(*damping))
    expected = _assembled(axis, 0.75 if distance is None else distance)
    for name, found, wanted in zip(("M", "K", "B"), axis.matrices(distance), expected, strict=True):
        for i in range(6):
            for j in range(6):
                assert np.isclose(found[i, j], wanted[i, j], rtol=1e-12, atol=1e-12), (name, i, j)


def test_equations_of_motion_are_the_matrices():
    """Friction aside, the vector field at mid-stroke has the stiffness and damping of matrix 18 as its slopes."""
    axis = mauro_axis()
    mass, k, b = axis.matrices()
    state, inputs = axis.initial_state(), axis.rest_inputs()

    def accelerations(x, v):
        moved = state._replace(**dict(zip(state._fields[:12], [*x, *v], strict=True)))
        friction = jnp.zeros(6).at[2].set(axis.friction(v[2]))
        return mass @ jnp.stack(axis.vector_field(jnp.zeros(()), moved, inputs)[6:12]) + friction

    by_x, by_v = jax.jit(jax.jacfwd(accelerations, argnums=(0, 1)))(jnp.zeros(6), jnp.zeros(6))
    assert np.allclose(by_x, -k, rtol=1e-12, atol=1e-6)
    assert np.allclose(by_v, -b, rtol=1e-12, atol=1e-6)


def test_first_natural_frequency_and_damping_ratio():
    """Section 5: 152 Hz and 3 %, the nut at mid-stroke."""
    found = modes(mauro_axis().second_order())
    assert found.frequency[0] == 0.0
    assert np.isclose(found.frequency[1], 152.0, atol=0.1)
    assert np.isclose(found.damping_ratio[1], 0.03, rtol=1e-12)
    # eq. 19: damping in proportion to stiffness has ratios in proportion to frequency.
    assert np.allclose(found.damping_ratio, 0.03 * found.frequency / found.frequency[1], rtol=1e-9)


def test_support_deforms_at_least_twice_as_much_as_any_other_spring():
    """Fig. 9, in the axial measure."""
    axial = {name: abs(float(x)) for name, x in spring_deformations(mauro_axis()).axial._asdict().items()}
    support = axial.pop("support")
    assert support >= 2 * max(axial.values()), axial


def test_frequency_rises_with_the_stiffness_between_screw_and_ground():
    """Fig. 10: from half to one and a half of the nominal k₀ᴬ."""
    axis = mauro_axis()
    nominal = axis.stiffness()

    def first(factor):
        system = axis.second_order(stiffness=nominal._replace(support=factor * nominal.support))
        return modes(system).frequency[1]

    found = jax.jit(jax.vmap(first))(jnp.linspace(0.5, 1.5, 5))
    assert np.all(np.diff(found) > 0)
    assert np.isclose(found[2], 152.0, atol=0.1)
    # The elasticity of about 0.42 that the modes tell is what the range gives.
    assert np.isclose(np.log(found[-1] / found[0]) / np.log(3.0), 0.42, atol=0.02)


def test_nut_far_from_the_bearing_makes_the_axis_softer():
    axis = mauro_axis()
    reach = 0.75 + HALF_STROKE * np.array([-1.0, 0.0, 1.0])
    found = [float(modes(axis.second_order(distance)).frequency[1]) for distance in reach]
    assert found[0] > found[1] > found[2]


@pytest.mark.parametrize("mode", [1, 2, 5])
def test_structural_damping_of_any_mode(mode):
    """Eq. 21: b = 2ζ/ω."""
    axis = structural_damping(mauro_axis(), 0.01, mode, nut_position=0.4)
    found = modes(axis.second_order(0.4))
    assert np.isclose(found.damping_ratio[mode], 0.01, rtol=1e-12)
    assert np.isclose(axis.damping.time, 0.02 / (2 * np.pi * found.frequency[mode]), rtol=1e-12)
