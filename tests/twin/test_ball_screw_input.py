"""What a ball screw axis refuses, and that it says which value, why, and what to do."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import TypeCheckError

from twin._checks import InputError
from twin.drives import (
    BallScrewAxis,
    DcMotor,
    RigidScrewAxis,
    ScrewShaft,
    ScrewSprings,
    SpringDampers,
    StructuralDamping,
    ball_screw_axis,
    mauro,
    mauro_axis,
    spring_deformations,
    structural_damping,
)
from twin.laws import ViscousFriction
from twin.modal import modes


def rebuilt(axis, **changes):
    return BallScrewAxis(**{**{name: getattr(axis, name) for name in axis.__dataclass_fields__}, **changes})


def catalogue(**changes):
    values = dict(
        shaft_diameter=0.045,
        length=1.5,
        lead=0.02,
        nut_position=0.75,
        end_diameter=0.03,
        end_length=0.12,
        motor=DcMotor(*mauro.MOTOR),
        motor_inertia=3e-3,
        motor_shaft=6e4,
        coupling=5e4,
        coupling_inertia=6e-4,
        bearing=3e9,
        support=4e8,
        nut=1.5e9,
        flange=3e9,
        nut_mass=5.0,
        slide_mass=200.0,
        friction=ViscousFriction(0.02),
    )
    return ball_screw_axis(**{**values, **changes})


@pytest.mark.parametrize(
    "name, value, words",
    [
        ("slide_mass", 0.0, "slide_mass of the ball screw axis must be positive"),
        ("motor_inertia", -1e-3, "motor_inertia must be positive"),
        ("coupling_inertia", 0.0, "coupling_inertia must be positive"),
        ("nut_mass", np.nan, "nut_mass of the ball screw axis must be finite"),
        ("support", 0.0, "stiffness of support must be positive"),
        ("coupling", -5e4, "stiffness of coupling must be positive"),
        ("bearing", np.inf, "stiffness of bearing must be finite"),
        ("lead", 0.0, "lead of the screw must not be zero"),
        ("lead", np.nan, "lead of the screw must be finite"),
        ("nut_position", 1.6, "nut_position must lie on the screw, between 0 and its length of 1.5 m"),
        ("nut_position", -0.1, "nut_position of the ball screw axis must be positive"),
        ("shaft_diameter", 0.0, "shaft_diameter must be positive"),
        ("length", np.inf, "length must be finite"),
        ("density", -1.0, "density must be positive"),
        ("shear_modulus", 0.0, "shear_modulus must be positive"),
        ("damping_ratio", -0.01, "ratio must not be negative"),
    ],
)
def test_catalogue_refuses(name, value, words):
    with pytest.raises(InputError, match=words):
        catalogue(**{name: value})


def test_parts_refuse():
    axis = mauro_axis()
    with pytest.raises(InputError, match="screw_inertia"):
        rebuilt(axis, screw_inertia=0.0)
    with pytest.raises(InputError, match="inductance of the motor"):
        DcMotor(0.35, 0.0, 1.5, 1.5)
    with pytest.raises(InputError, match="axial_rigidity"):
        ScrewShaft(0.0, 1e4, 1.5)
    with pytest.raises(InputError, match="stiffness of nut"):
        ScrewSprings(1e4, 1e4, 1e4, ScrewShaft(1e8, 1e4, 1.5), 1e8, 1e9, -1.0, 1e9)
    with pytest.raises(InputError, match="structural damping"):
        StructuralDamping(-1e-5)
    with pytest.raises(InputError, match="damping of torsion"):
        SpringDampers(1.0, -1.0, 1.0, 1.0, 1.0)
    with pytest.raises(InputError, match="inertia of the rigid"):
        RigidScrewAxis(axis.motor, 0.0, 0.02, axis.friction)
    with pytest.raises(InputError, match="lead of the screw must not be zero"):
        RigidScrewAxis(axis.motor, 0.01, 0.0, axis.friction)
    with pytest.raises(InputError, match="nut_position must lie on the screw"):
        axis.matrices(1.51)
    with pytest.raises(InputError, match="nut_position must be positive"):
        axis.second_order(0.0)
    for mode in (0, 6):
        with pytest.raises(InputError, match="mode must be 1 to 5"):
            spring_deformations(axis, mode)
        with pytest.raises(InputError, match="mode must be 1 to 5"):
            structural_damping(axis, 0.03, mode)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("shaft_diameter", "45 mm"),
        ("shaft_diameter", np.array([0.04, 0.05])),
        ("slide_mass", np.array([100.0, 200.0])),
        ("damping_ratio", -0.1),
        ("motor", None),
        ("friction", None),
        ("friction", 1.2),
    ],
)
def test_what_is_no_value_for_the_catalogue_is_named(name, value):
    with pytest.raises((InputError, TypeCheckError), match=name):
        catalogue(**{name: value})


def test_a_bad_sample_of_a_batch_is_marked():
    """Inside a batch nothing raises: a negative mass gives no modes but NaN, and leaves the others alone."""
    axis = mauro_axis()

    def first(mass):
        return modes(eqx.tree_at(lambda a: a.slide_mass, axis, mass).second_order()).frequency[1]

    found = jax.jit(jax.vmap(first))(jnp.array([200.0, -200.0, 300.0]))
    assert np.array_equal(np.isnan(found), [False, True, False])

    def beyond(distance):
        return modes(axis.second_order(distance)).frequency[1]

    found = jax.jit(jax.vmap(beyond))(jnp.array([-0.1, 0.75, 1.6]))
    assert np.array_equal(np.isnan(found), [True, False, True])


def test_left_hand_screw_mirrors_the_motion_and_keeps_the_modes():
    axis = mauro_axis()
    left = rebuilt(axis, lead=-axis.lead)
    right_modes, left_modes = modes(axis.second_order()), modes(left.second_order())
    assert np.allclose(right_modes.eigenvalues, left_modes.eigenvalues, rtol=1e-9, atol=1e-2)
    assert np.isclose(left.travel_per_radian, -axis.travel_per_radian)
    assert np.isclose(left.rigid().inertia, axis.rigid().inertia)


def test_half_of_the_coupling_goes_to_each_side():
    light, heavy = catalogue(), catalogue(coupling_inertia=2.6e-3)
    assert np.isclose(heavy.motor_inertia - light.motor_inertia, 1e-3)
    assert np.isclose(heavy.end_inertia - light.end_inertia, 1e-3)
    assert np.isclose(light.screw_mass, 7850.0 * np.pi / 4 * 0.045**2 * 1.5)
    assert np.isclose(light.springs.screw.axial_stiffness(0.5), 2.1e11 * np.pi / 4 * 0.045**2 / 0.5)
    assert np.isclose(light.springs.screw.torsional_stiffness(0.5), 8.1e10 * np.pi / 32 * 0.045**4 / 0.5)


def test_catalogue_is_differentiable():
    """More diameter, stiffer screw: the first frequency's slope against a central difference."""

    def first(diameter):
        return modes(catalogue(shaft_diameter=diameter).second_order()).frequency[1]

    slope = jax.jit(jax.jacfwd(first))(0.045)
    difference = (first(0.0451) - first(0.0449)) / 2e-4
    assert np.isclose(slope, difference, rtol=1e-4)
