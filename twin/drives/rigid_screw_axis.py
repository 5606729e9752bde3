"""A ball screw axis without elasticity: one inertia at the motor shaft."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from twin._checks import as_scalar, positive
from twin.drives.dc_motor import DcMotor
from twin.drives.inputs import DriveInputs, no_inputs
from twin.drives.screw_outputs import ScrewAxisOutputs, screw_outputs
from twin.drives.screw_travel import check_lead, travel_per_radian
from twin.laws import AbstractFriction
from twin.plant import AbstractPlant


class RigidScrewState(NamedTuple):
    """State of a rigid ball screw axis."""

    angle: Float[Array, ""]
    """Angle of motor and screw θ [rad]."""
    speed: Float[Array, ""]
    """Speed of motor and screw [rad/s]."""
    current: Float[Array, ""]
    """Current i [A]."""
    friction: PyTree[Array]
    """Internal state of the friction law."""


class RigidScrewAxis(AbstractPlant):
    """J·θ̈ = k_T·i - T_f(θ̇) + h·load,  x = h·θ: what a ball screw axis is far below its first natural frequency.

    Raises:
        InputError: an inertia that is not positive and finite, a lead that is zero or not finite.
    """

    motor: DcMotor
    """The motor; its voltage is the command."""
    inertia: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Inertia J of everything that moves, at the motor shaft [kg m²]."""
    lead: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Lead of the screw p: travel per turn [m]; negative for a left-hand screw."""
    friction: AbstractFriction
    """Friction torque of the speed of the screw T_f [Nm]."""

    def __check_init__(self):
        positive("inertia of the rigid screw axis", self.inertia, "kg m²")
        check_lead(self.lead)

    @property
    def travel_per_radian(self) -> Float[Array, ""]:
        """Travel of the slide per angle h = p/2π [m/rad]."""
        return travel_per_radian(self.lead)

    def initial_state(self) -> RigidScrewState:
        zero = jnp.zeros(())
        return RigidScrewState(zero, zero, zero, self.friction.initial_state())

    def rest_inputs(self) -> DriveInputs:
        return no_inputs()

    def vector_field(self, t: Float[Array, ""], state: Any, inputs: Any) -> RigidScrewState:
        friction = self.friction.force(state.friction, state.speed, state.angle)
        torque = self.motor.torque(state.current) - friction + self.travel_per_radian * inputs.load
        return RigidScrewState(
            state.speed,
            torque / self.inertia,
            self.motor.current_rate(inputs.command, state.current, state.speed),
            self.friction.rate(state.friction, state.speed),
        )

    def outputs(self, t: Float[Array, ""], state: Any, inputs: Any) -> ScrewAxisOutputs:
        h = self.travel_per_radian
        return screw_outputs(
            self.motor, h * state.angle, h * state.speed, state.angle, state.speed, state.current, inputs.command
        )
