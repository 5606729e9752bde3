"""A drive of one's own: a swivelling axis whose centre of mass lies beside its bearing."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from twin._checks import as_scalar, finite, positive
from twin.drives.inputs import DriveInputs, no_inputs
from twin.laws import AbstractStaticFriction
from twin.plant import AbstractPlant


class SwivelState(NamedTuple):
    """State of the axis."""

    position: Float[Array, ""]
    """Angle φ from the lowest point [rad]."""
    velocity: Float[Array, ""]
    """Speed [rad/s]."""


class SwivelOutputs(NamedTuple):
    """What is recorded."""

    position: Float[Array, ""]
    """Angle φ [rad]."""
    velocity: Float[Array, ""]
    """Speed [rad/s]."""
    command: Float[Array, ""]
    """Current of the motor [A]."""


class SwivelAxis(AbstractPlant):
    """J·φ̈ = k_t·i - F(φ̇) - U·sin φ."""

    inertia: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Inertia J about the bearing [kg m²]."""
    unbalance: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Torque U of the weight at 90 degrees [Nm]."""
    friction: AbstractStaticFriction
    """Friction of bearing and seal [Nm]."""
    torque_constant: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Torque per current k_t [Nm/A]."""

    def __check_init__(self):
        positive("inertia", self.inertia, "kg m²")
        finite("unbalance", self.unbalance, "Nm")

    def initial_state(self) -> SwivelState:
        return SwivelState(jnp.zeros(()), jnp.zeros(()))

    def rest_inputs(self) -> DriveInputs:
        return no_inputs()

    def vector_field(self, t: Float[Array, ""], state: Any, inputs: Any) -> SwivelState:
        torque = self.torque_constant * inputs.command + inputs.load
        torque = torque - self.friction(state.velocity) - self.unbalance * jnp.sin(state.position)
        return SwivelState(state.velocity, torque / self.inertia)

    def outputs(self, t: Float[Array, ""], state: Any, inputs: Any) -> SwivelOutputs:
        return SwivelOutputs(state.position, state.velocity, jnp.asarray(inputs.command))
