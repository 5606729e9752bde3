"""What is recorded on a ball screw axis, elastic or rigid."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin.drives.dc_motor import DcMotor


class ScrewAxisOutputs(NamedTuple):
    """What is recorded on a ball screw axis."""

    position: Float[Array, ""]
    """Position of the slide x₃, zero at mid-stroke [m]."""
    velocity: Float[Array, ""]
    """Velocity of the slide [m/s]."""
    motor_angle: Float[Array, ""]
    """Angle of the motor θ₁ [rad]."""
    motor_speed: Float[Array, ""]
    """Speed of the motor [rad/s]."""
    current: Float[Array, ""]
    """Torque-generating current i [A]."""
    torque: Float[Array, ""]
    """Torque of the motor T_M = k_T·i [Nm]."""
    voltage: Float[Array, ""]
    """Armature voltage V_a [V]."""
    power: Float[Array, ""]
    """Electrical power V_a·i drawn from the amplifier, negative where it is fed back [W]."""
    command: Float[Array, ""]
    """What the amplifier is told [V]; the armature voltage unless an actuator with a lag or delay is in between."""


def screw_outputs(
    motor: DcMotor,
    position: Float[Array, ""],
    velocity: Float[Array, ""],
    motor_angle: Float[Array, ""],
    motor_speed: Float[Array, ""],
    current: Float[Array, ""],
    voltage: Float[ArrayLike, ""],
) -> ScrewAxisOutputs:
    """The outputs from what moves and what flows.

    Args:
        motor: the motor, for its torque.
        position: of the slide [m].
        velocity: of the slide [m/s].
        motor_angle: [rad].
        motor_speed: [rad/s].
        current: [A].
        voltage: armature voltage [V].
    """
    v = jnp.asarray(voltage)
    torque = motor.torque(current)
    return ScrewAxisOutputs(position, velocity, motor_angle, motor_speed, current, torque, v, v * current, v)
