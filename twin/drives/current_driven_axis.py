"""A rigid axis driven by the current of its motor: torque constant and travel per turn instead of a force constant."""

from typing import Any

import equinox as eqx
from jaxtyping import Array, Float

from twin._checks import as_scalar, positive
from twin.drives.inputs import DriveInputs, no_inputs
from twin.drives.screw_travel import check_lead, travel_per_radian
from twin.drives.servo_axis import ServoAxis, ServoAxisOutputs, ServoAxisState
from twin.laws import AbstractFriction, AbstractPositionForce, NoForce
from twin.plant import AbstractPlant


class CurrentDrivenAxis(AbstractPlant):
    """M·q̈ = (2π/p)·k_T·i + load - F_friction(q̇) - F_position(q) - offset: a `ServoAxis` with data-sheet values.

    Its command is the current, so that it can follow a measured one whatever the controller was. A torque constant that
    is wrong by some per cent makes mass and friction wrong by as many.

    Raises:
        InputError: a mass or torque constant that is not positive, a travel per turn that is zero or not finite.
    """

    torque_constant: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Torque constant k_T of the motor, torque over current as it was recorded [N m/A]."""
    travel_per_turn: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Travel p per turn of the motor: the lead of a screw; of a pinion its circumference, over the gear ratio [m]."""
    mass: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Moved mass M, with the inertia of motor and transmission reduced to the axis [kg]."""
    friction: AbstractFriction
    """Friction law of the axis's speed [N]."""
    offset: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Constant force against positive motion: gravity, zero of the current [N]."""
    position_force: AbstractPositionForce = eqx.field(default_factory=NoForce)
    """Force against positive motion over the position: cogging, pitch error [N]."""
    initial_position: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Position where a record begins [m]."""
    initial_velocity: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Velocity there [m/s]."""

    def __check_init__(self):
        positive("torque_constant", self.torque_constant, "N m/A")
        check_lead(self.travel_per_turn)
        self.axis.__check_init__()

    @property
    def gain(self) -> Float[Array, ""]:
        """Force per current 2π·k_T/p [N/A]."""
        return self.torque_constant / travel_per_radian(self.travel_per_turn)

    @property
    def motor_inertia(self) -> Float[Array, ""]:
        """Everything that moves, as an inertia at the shaft of the motor M·(p/2π)² [kg m²]."""
        return self.mass * travel_per_radian(self.travel_per_turn) ** 2

    @property
    def axis(self) -> ServoAxis:
        """The same axis with its force constant."""
        return ServoAxis(
            mass=self.mass,
            friction=self.friction,
            gain=self.gain,
            offset=self.offset,
            position_force=self.position_force,
            initial_position=self.initial_position,
            initial_velocity=self.initial_velocity,
        )

    def initial_state(self) -> ServoAxisState:
        return self.axis.initial_state()

    def rest_inputs(self) -> DriveInputs:
        return no_inputs()

    def vector_field(self, t: Float[Array, ""], state: Any, inputs: Any) -> ServoAxisState:
        return self.axis.vector_field(t, state, inputs)

    def outputs(self, t: Float[Array, ""], state: Any, inputs: Any) -> ServoAxisOutputs:
        return self.axis.outputs(t, state, inputs)
