"""The electrically preloaded rack-and-pinion drive: two motors, each with its pinion, on one table."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float, PyTree

from twin._checks import as_scalar, positive
from twin.laws import AbstractFriction, AbstractMesh, AbstractPositionForce, NoForce, smooth_clip
from twin.plant import AbstractPlant


class TorquePair(NamedTuple):
    """One torque for each of the two motors."""

    motor_1: Float[Array, ""]
    """Torque of motor 1, positive where it drives the table forwards [Nm]."""
    motor_2: Float[Array, ""]
    """Torque of motor 2, positive where it drives the table forwards [Nm]."""


class RackPinionInputs(NamedTuple):
    """Inputs of a rack-and-pinion drive with two motors."""

    command: TorquePair
    """Torques that the motors are told to give [Nm]."""
    load: Float[Array, ""]
    """Process force on the table, positive in the direction of motion [N]."""


class RackPinionState(NamedTuple):
    """State of a rack-and-pinion drive with two motors."""

    angle_1: Float[Array, ""]
    """Angle of motor 1 φ₁ [rad]."""
    angle_2: Float[Array, ""]
    """Angle of motor 2 φ₂ [rad]."""
    table_position: Float[Array, ""]
    """Table position x_T [m]."""
    speed_1: Float[Array, ""]
    """Speed of motor 1 [rad/s]."""
    speed_2: Float[Array, ""]
    """Speed of motor 2 [rad/s]."""
    table_velocity: Float[Array, ""]
    """Table velocity v_T [m/s]."""
    friction_1: PyTree[Array]
    """Internal state of the friction of motor 1."""
    friction_2: PyTree[Array]
    """Internal state of the friction of motor 2."""
    table_friction: PyTree[Array]
    """Internal state of the friction of the table."""


class RackPinionOutputs(NamedTuple):
    """What is recorded on a rack-and-pinion drive, and the forces that cannot be."""

    position_1: Float[Array, ""]
    """Travel of the pitch circle of pinion 1 x₁ = r·φ₁, that is of motor 1 behind its gearbox [m]."""
    position_2: Float[Array, ""]
    """Travel of the pitch circle of pinion 2 x₂ [m]."""
    velocity_1: Float[Array, ""]
    """Velocity of the pitch circle of pinion 1 v₁ [m/s]."""
    velocity_2: Float[Array, ""]
    """Velocity of the pitch circle of pinion 2 v₂ [m/s]."""
    table_position: Float[Array, ""]
    """Table position x_T [m]."""
    table_velocity: Float[Array, ""]
    """Table velocity v_T [m/s]."""
    torque_1: Float[Array, ""]
    """Torque that motor 1 gives, within its limit τ₁ [Nm]."""
    torque_2: Float[Array, ""]
    """Torque that motor 2 gives τ₂ [Nm]."""
    force_1: Float[Array, ""]
    """Force through the mesh of pinion 1, positive where it drives the table forwards [N]."""
    force_2: Float[Array, ""]
    """Force through the mesh of pinion 2 [N]."""


class DriveTrain(eqx.Module):
    """A motor with its gearbox and pinion.

    Raises:
        InputError: if the inertia or a torque is not positive and finite.
    """

    inertia: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Inertia of motor, gearbox and pinion at the motor shaft J [kg m²]."""
    friction: AbstractFriction
    """Friction torque over the motor's speed [Nm over rad/s]."""
    mesh: AbstractMesh
    """Pinion in rack, with what else yields between the motor and the table."""
    torque_limit: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Largest torque that the motor gives [Nm]."""
    cogging: AbstractPositionForce = eqx.field(default_factory=NoForce)
    """Torque over the motor's angle, against positive motion: cogging, eccentric gears [Nm over rad]."""

    def __check_init__(self):
        positive("inertia of the drive train", self.inertia, "kg m²")
        positive("torque_limit of the drive train", self.torque_limit, "Nm")

    def torque(self, command: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        """Torque that the motor gives, within its limit [Nm].

        Args:
            command: torque that it is told to give [Nm].
        """
        return smooth_clip(command, self.torque_limit)


class RackPinionDrive(AbstractPlant):
    """J·φ̈ᵢ = τᵢ - Mᵢ(φ̇ᵢ) - r·Fᵢ for both motors,  m·ẍ_T = F₁ + F₂ + load - F_f(ẋ_T),  Fᵢ = mesh(r·φᵢ - x_T, ...).

    r = d_p/(2·i_g) is the travel per radian of the motor, so that a motor torque τ is a force τ/r = 2·i_g/d_p·τ at the
    rack. Three masses, as Leipe et al., fig. 1, with the backlash that they add for their validation.

    Raises:
        InputError: if the mass, the ratio or the diameter is not positive and finite.
    """

    train_1: DriveTrain
    """Motor 1 with gearbox and pinion."""
    train_2: DriveTrain
    """Motor 2 with gearbox and pinion."""
    table_mass: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Mass moved in translation m [kg]."""
    table_friction: AbstractFriction
    """Friction of the table's guides [N over m/s]."""
    gear_ratio: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Ratio of the gearboxes i_g [-]."""
    pinion_diameter: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Pitch diameter of the pinions d_p [m]."""

    def __check_init__(self):
        positive("table_mass", self.table_mass, "kg")
        positive("gear_ratio", self.gear_ratio)
        positive("pinion_diameter", self.pinion_diameter, "m")

    @property
    def travel_per_radian(self) -> Float[Array, ""]:
        """Travel of the table per radian of a motor r = d_p/(2·i_g) [m/rad]."""
        return self.pinion_diameter / (2 * self.gear_ratio)

    def motor_force(self, torque: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        """Force at the rack of a motor torque F = 2·i_g/d_p·τ [N].

        Args:
            torque: τ of any shape [Nm].
        """
        return jnp.asarray(torque) / self.travel_per_radian

    def initial_state(self) -> RackPinionState:
        """At rest at zero, both pinions in the middle of their play."""
        zero = jnp.zeros(())
        return RackPinionState(
            zero,
            zero,
            zero,
            zero,
            zero,
            zero,
            self.train_1.friction.initial_state(),
            self.train_2.friction.initial_state(),
            self.table_friction.initial_state(),
        )

    def rest_inputs(self) -> RackPinionInputs:
        zero = jnp.zeros(())
        return RackPinionInputs(TorquePair(zero, zero), zero)

    def vector_field(self, t: Float[Array, ""], state: Any, inputs: Any) -> RackPinionState:
        r = self.travel_per_radian
        one, two, table = self.train_1, self.train_2, self.table_friction
        torque_1, torque_2, force_1, force_2 = self._loads(state, inputs)
        lost_1 = one.friction.force(state.friction_1, state.speed_1, state.angle_1) + one.cogging(state.angle_1)
        lost_2 = two.friction.force(state.friction_2, state.speed_2, state.angle_2) + two.cogging(state.angle_2)
        guides = table.force(state.table_friction, state.table_velocity, state.table_position)
        return RackPinionState(
            state.speed_1,
            state.speed_2,
            state.table_velocity,
            (torque_1 - lost_1 - r * force_1) / one.inertia,
            (torque_2 - lost_2 - r * force_2) / two.inertia,
            (force_1 + force_2 + inputs.load - guides) / self.table_mass,
            one.friction.rate(state.friction_1, state.speed_1),
            two.friction.rate(state.friction_2, state.speed_2),
            table.rate(state.table_friction, state.table_velocity),
        )

    def outputs(self, t: Float[Array, ""], state: Any, inputs: Any) -> RackPinionOutputs:
        r = self.travel_per_radian
        return RackPinionOutputs(
            r * state.angle_1,
            r * state.angle_2,
            r * state.speed_1,
            r * state.speed_2,
            state.table_position,
            state.table_velocity,
            *self._loads(state, inputs),
        )

    def _loads(self, state: Any, inputs: Any) -> tuple[Array, Array, Array, Array]:
        """Torques of the motors and forces through the meshes."""
        r = self.travel_per_radian
        torque_1 = self.train_1.torque(inputs.command.motor_1)
        torque_2 = self.train_2.torque(inputs.command.motor_2)
        deflection_1 = r * state.angle_1 - state.table_position
        deflection_2 = r * state.angle_2 - state.table_position
        rate_1 = r * state.speed_1 - state.table_velocity
        rate_2 = r * state.speed_2 - state.table_velocity
        force_1 = self.train_1.mesh.force(deflection_1, rate_1, torque_1 / r)
        force_2 = self.train_2.mesh.force(deflection_2, rate_2, torque_2 / r)
        return torque_1, torque_2, force_1, force_2
