"""A ball screw axis from what a designer has: dimensions, material, and catalogue values."""

import jax.numpy as jnp
from jaxtyping import ArrayLike, Float

from twin._checks import InputError, not_negative, positive, single_number
from twin.drives.ball_screw import BallScrewAxis
from twin.drives.ball_screw_modes import structural_damping
from twin.drives.dc_motor import DcMotor
from twin.drives.screw_damping import StructuralDamping
from twin.drives.screw_springs import ScrewShaft, ScrewSprings
from twin.laws import AbstractFriction

_STEEL = {"density": 7850.0, "youngs_modulus": 2.1e11, "shear_modulus": 8.1e10}


def ball_screw_axis(
    *,
    shaft_diameter: Float[ArrayLike, ""],
    length: Float[ArrayLike, ""],
    lead: Float[ArrayLike, ""],
    nut_position: Float[ArrayLike, ""],
    end_diameter: Float[ArrayLike, ""],
    end_length: Float[ArrayLike, ""],
    motor: DcMotor,
    motor_inertia: Float[ArrayLike, ""],
    motor_shaft: Float[ArrayLike, ""],
    coupling: Float[ArrayLike, ""],
    coupling_inertia: Float[ArrayLike, ""],
    bearing: Float[ArrayLike, ""],
    support: Float[ArrayLike, ""],
    nut: Float[ArrayLike, ""],
    flange: Float[ArrayLike, ""],
    nut_mass: Float[ArrayLike, ""],
    slide_mass: Float[ArrayLike, ""],
    friction: AbstractFriction,
    damping_ratio: Float[ArrayLike, ""] = 0.03,
    density: Float[ArrayLike, ""] = _STEEL["density"],
    youngs_modulus: Float[ArrayLike, ""] = _STEEL["youngs_modulus"],
    shear_modulus: Float[ArrayLike, ""] = _STEEL["shear_modulus"],
) -> BallScrewAxis:
    """A ball screw axis from dimensions, material and catalogue values; differentiable in all of them.

    Screw and end are solid cylinders. Half of the coupling's inertia goes with the motor, half with the screw's end.

    Args:
        shaft_diameter: root diameter of the screw [m].
        length: length of the screw from the fixed bearing [m].
        lead: travel per turn [m]; negative for a left-hand screw.
        nut_position: distance of the nut from the fixed bearing at mid-stroke [m].
        end_diameter: diameter of the screw's end journal [m].
        end_length: length of the end journal between coupling and fixed bearing [m].
        motor: electrics of the motor.
        motor_inertia: inertia of the rotor [kg m²].
        motor_shaft: torsional stiffness of the motor's shaft [Nm/rad].
        coupling: torsional stiffness of the coupling [Nm/rad].
        coupling_inertia: inertia of the coupling [kg m²].
        bearing: axial stiffness of the fixed bearing [N/m].
        support: axial stiffness of the structure that holds the bearing [N/m].
        nut: axial stiffness of the nut's balls and races at its preload [N/m].
        flange: axial stiffness of the nut's flange and its screws [N/m].
        nut_mass: mass of the nut [kg].
        slide_mass: mass of the slide [kg].
        friction: friction torque of the speed of the screw [Nm].
        damping_ratio: damping ratio of the first elastic mode at mid-stroke, by damping in proportion to stiffness [-].
        density: of the screw [kg/m³]; of steel if not given.
        youngs_modulus: of the screw [N/m²]; of steel if not given.
        shear_modulus: of the screw [N/m²]; of steel if not given.

    Raises:
        InputError: a dimension, material constant, inertia, mass or stiffness that is not positive and finite, a lead
            of zero, a nut beyond the screw, a damping ratio that is negative, more than one number for a value, a motor
            that is no `DcMotor`, friction that is no law.

    Source: Mauro, Pastorelli, Mohtar (2014), section 5.
    """
    if not isinstance(motor, DcMotor):
        raise InputError(f"motor must be a DcMotor, the electrics of the motor, but is a {type(motor).__name__}.")
    if not isinstance(friction, AbstractFriction):
        raise InputError(
            f"friction must be a friction law, but is a {type(friction).__name__}. Give one of twin.laws, "
            "CoulombViscousFriction for instance."
        )
    numbers = {"shaft_diameter": shaft_diameter, "length": length, "lead": lead, "nut_position": nut_position}
    numbers |= {"end_diameter": end_diameter, "end_length": end_length, "motor_inertia": motor_inertia}
    numbers |= {"motor_shaft": motor_shaft, "coupling": coupling, "coupling_inertia": coupling_inertia}
    numbers |= {"bearing": bearing, "support": support, "nut": nut, "flange": flange, "nut_mass": nut_mass}
    numbers |= {"slide_mass": slide_mass, "damping_ratio": damping_ratio, "density": density}
    numbers |= {"youngs_modulus": youngs_modulus, "shear_modulus": shear_modulus}
    for name, value in numbers.items():
        single_number(name, value)
    lengths = {"shaft_diameter": shaft_diameter, "length": length, "end_diameter": end_diameter}
    lengths |= {"end_length": end_length}
    for name, value in lengths.items():
        positive(name, value, "m")
    positive("density", density, "kg/m³")
    positive("youngs_modulus", youngs_modulus, "N/m²")
    positive("shear_modulus", shear_modulus, "N/m²")
    positive("motor_inertia", motor_inertia, "kg m²")
    positive("coupling_inertia", coupling_inertia, "kg m²")
    not_negative("damping_ratio", damping_ratio)
    area, polar = jnp.pi / 4 * jnp.asarray(shaft_diameter) ** 2, jnp.pi / 32 * jnp.asarray(shaft_diameter) ** 4
    end_polar = jnp.pi / 32 * jnp.asarray(end_diameter) ** 4
    springs = ScrewSprings(
        motor_shaft=motor_shaft,
        coupling=coupling,
        screw_end=shear_modulus * end_polar / end_length,
        screw=ScrewShaft(youngs_modulus * area, shear_modulus * polar, length),
        support=support,
        bearing=bearing,
        nut=nut,
        flange=flange,
    )
    axis = BallScrewAxis(
        motor=motor,
        motor_inertia=motor_inertia + coupling_inertia / 2,
        end_inertia=density * end_polar * end_length + coupling_inertia / 2,
        screw_inertia=density * polar * length,
        screw_mass=density * area * length,
        nut_mass=nut_mass,
        slide_mass=slide_mass,
        lead=lead,
        springs=springs,
        damping=StructuralDamping(0.0),
        friction=friction,
        nut_position=nut_position,
    )
    return structural_damping(axis, damping_ratio)
