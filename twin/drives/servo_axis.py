"""A rigid servo axis: one mass, driven by a motor force against friction."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from twin._checks import as_scalar, finite, positive
from twin.drives.inputs import DriveInputs, no_inputs
from twin.laws import AbstractFriction, AbstractPositionForce, NoForce
from twin.plant import AbstractPlant


class ServoAxisState(NamedTuple):
    """State of a servo axis."""

    position: Float[Array, ""]
    """Position q [m or rad]."""
    velocity: Float[Array, ""]
    """Velocity q̇ [m/s or rad/s]."""
    friction: PyTree[Array]
    """Internal state of the friction law; empty for laws without memory."""


class ServoAxisOutputs(NamedTuple):
    """What is recorded on a servo axis."""

    position: Float[Array, ""]
    """Position q [m or rad]."""
    velocity: Float[Array, ""]
    """Velocity q̇ [m/s or rad/s]."""
    command: Float[Array, ""]
    """Command u given to the actuator [command unit]."""
    force: Float[Array, ""]
    """Driving force g·u [N or Nm]."""


class ServoAxis(AbstractPlant):
    """M·q̈ = g·u + load - F_friction(q̇) - F_position(q) - offset.

    Written for a linear axis; with an inertia in kg m², angles in rad and torques in Nm it is a rotary one. With
    viscous and Coulomb friction it is the model of the EMPS bench (Janot, Gautier, Brunot 2019).
    """

    mass: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Moved mass M, with the inertia of motor and screw reduced to the axis [kg or kg m²]."""
    friction: AbstractFriction
    """Friction law of the axis's speed [N or Nm]."""
    gain: Float[Array, ""] = eqx.field(converter=as_scalar, default=1.0)
    """Force per unit of command g [N/V, N/A, ...]."""
    offset: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Constant force against positive motion: gravity, amplifier offset [N or Nm]."""
    position_force: AbstractPositionForce = eqx.field(default_factory=NoForce)
    """Force against positive motion as a function of position: cogging, screw pitch error [N or Nm]."""
    initial_position: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Position at the start [m or rad]."""
    initial_velocity: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Velocity at the start [m/s or rad/s]."""

    def __check_init__(self):
        positive("mass", self.mass, "kg")
        finite("gain", self.gain)
        finite("offset", self.offset, "N")
        finite("initial_position", self.initial_position, "m")
        finite("initial_velocity", self.initial_velocity, "m/s")

    def initial_state(self) -> ServoAxisState:
        return ServoAxisState(self.initial_position, self.initial_velocity, self.friction.initial_state())

    def rest_inputs(self) -> DriveInputs:
        return no_inputs()

    def vector_field(self, t: Float[Array, ""], state: Any, inputs: Any) -> ServoAxisState:
        resisting = (
            self.friction.force(state.friction, state.velocity, state.position)
            + self.position_force(state.position)
            + self.offset
        )
        acceleration = (self.gain * inputs.command + inputs.load - resisting) / self.mass
        return ServoAxisState(state.velocity, acceleration, self.friction.rate(state.friction, state.velocity))

    def outputs(self, t: Float[Array, ""], state: Any, inputs: Any) -> ServoAxisOutputs:
        return ServoAxisOutputs(state.position, state.velocity, jnp.asarray(inputs.command), self.gain * inputs.command)
