"""Two inertias coupled by a shaft: motor and load, the smallest drive with a resonance."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float, PyTree

from twin._checks import as_scalar, finite, not_negative, positive
from twin.drives.friction_slope import friction_slope
from twin.drives.inputs import DriveInputs, no_inputs
from twin.laws import AbstractFriction
from twin.linear import SecondOrder
from twin.plant import AbstractPlant


class TwoMassState(NamedTuple):
    """State of a two-mass drive."""

    motor_position: Float[Array, ""]
    """Motor angle φ₁ [rad or m]."""
    load_position: Float[Array, ""]
    """Load angle φ₂ [rad or m]."""
    motor_velocity: Float[Array, ""]
    """Motor speed [rad/s or m/s]."""
    load_velocity: Float[Array, ""]
    """Load speed [rad/s or m/s]."""
    motor_friction: PyTree[Array]
    """Internal state of the motor's friction law."""
    load_friction: PyTree[Array]
    """Internal state of the load's friction law."""


class TwoMassOutputs(NamedTuple):
    """What is recorded on a two-mass drive."""

    position: Float[Array, ""]
    """Motor angle φ₁ [rad or m]: the encoder that a motor-side controller sees."""
    velocity: Float[Array, ""]
    """Motor speed [rad/s or m/s]."""
    load_position: Float[Array, ""]
    """Load angle φ₂ [rad or m]."""
    load_velocity: Float[Array, ""]
    """Load speed [rad/s or m/s]."""
    shaft: Float[Array, ""]
    """Torque or force in the shaft, positive where it drives the load [Nm or N]."""
    command: Float[Array, ""]
    """Command u given to the actuator [command unit]."""


class TwoMass(AbstractPlant):
    """J₁·φ̈₁ = g·u - T - M₁(φ̇₁),  J₂·φ̈₂ = T + load - M₂(φ̇₂),  T = k(φ₁ - φ₂) + d(φ̇₁ - φ̇₂).

    Written for rotation; with masses in kg and positions in m it is a linear drive. All parameters may be known only up
    to the torque constant: with g = 1 they are in units of it.
    """

    motor_inertia: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Motor inertia J₁ [kg m² or kg]."""
    load_inertia: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Load inertia J₂ [kg m² or kg]."""
    stiffness: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Shaft stiffness k [Nm/rad or N/m]."""
    damping: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Shaft damping d [Nms/rad or Ns/m]."""
    motor_friction: AbstractFriction
    """Friction law of the motor M₁ [Nm or N]."""
    load_friction: AbstractFriction
    """Friction law of the load M₂ [Nm or N]."""
    gain: Float[Array, ""] = eqx.field(converter=as_scalar, default=1.0)
    """Torque or force per unit of command g [Nm/A, ...]."""

    def __check_init__(self):
        positive("motor_inertia", self.motor_inertia, "kg m²")
        positive("load_inertia", self.load_inertia, "kg m²")
        positive("stiffness", self.stiffness, "Nm/rad")
        not_negative("damping", self.damping, "Nms/rad")
        finite("gain", self.gain)

    def initial_state(self) -> TwoMassState:
        zero = jnp.zeros(())
        return TwoMassState(
            zero, zero, zero, zero, self.motor_friction.initial_state(), self.load_friction.initial_state()
        )

    def rest_inputs(self) -> DriveInputs:
        return no_inputs()

    def shaft(self, state: Any) -> Float[Array, ""]:
        """Torque or force in the shaft T [Nm or N]."""
        twist = state.motor_position - state.load_position
        twist_rate = state.motor_velocity - state.load_velocity
        return self.stiffness * twist + self.damping * twist_rate

    def vector_field(self, t: Float[Array, ""], state: Any, inputs: Any) -> TwoMassState:
        shaft = self.shaft(state)
        motor = (
            self.gain * inputs.command
            - shaft
            - self.motor_friction.force(state.motor_friction, state.motor_velocity, state.motor_position)
        )
        load = (
            shaft
            + inputs.load
            - self.load_friction.force(state.load_friction, state.load_velocity, state.load_position)
        )
        return TwoMassState(
            state.motor_velocity,
            state.load_velocity,
            motor / self.motor_inertia,
            load / self.load_inertia,
            self.motor_friction.rate(state.motor_friction, state.motor_velocity),
            self.load_friction.rate(state.load_friction, state.load_velocity),
        )

    def outputs(self, t: Float[Array, ""], state: Any, inputs: Any) -> TwoMassOutputs:
        return TwoMassOutputs(
            state.motor_position,
            state.motor_velocity,
            state.load_position,
            state.load_velocity,
            self.shaft(state),
            jnp.asarray(inputs.command),
        )

    def second_order(self, velocity: Float[ArrayLike, ""] = 0.0) -> SecondOrder:
        """The drive as M·ẍ + C·ẋ + K·x = B·u, its friction replaced by its slope.

        Args:
            velocity: speed of both bodies at which the slope is taken [rad/s or m/s].

        Returns:
            Inputs `command` and `load`, outputs `position` and `load_position`.

        Raises:
            InputError: if a friction law has memory: its force has no slope over the speed alone; use `linearise`.
        """
        k, d, zero = self.stiffness, self.damping, jnp.zeros(())
        motor = friction_slope("motor_friction", self.motor_friction, velocity)
        load = friction_slope("load_friction", self.load_friction, velocity)
        return SecondOrder(
            mass=jnp.diag(jnp.stack([self.motor_inertia, self.load_inertia])),
            viscous=jnp.stack([jnp.stack([d + motor, -d]), jnp.stack([-d, d + load])]),
            hysteretic=jnp.zeros((2, 2)),
            stiffness=jnp.stack([jnp.stack([k, -k]), jnp.stack([-k, k])]),
            input_map=jnp.stack([jnp.stack([self.gain, zero]), jnp.stack([zero, zero + 1.0])]),
            output_map=jnp.eye(2),
            inputs=("command", "load"),
            outputs=("position", "load_position"),
        )
