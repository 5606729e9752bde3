"""State of a ball screw axis."""

from typing import NamedTuple

from jaxtyping import Array, Float, PyTree


class BallScrewState(NamedTuple):
    """State of a ball screw axis: six degrees of freedom, the motor's current, the memory of friction."""

    motor_angle: Float[Array, ""]
    """Angle of the motor θ₁ [rad]."""
    end_angle: Float[Array, ""]
    """Angle of the screw's end θ₂ [rad]."""
    screw_angle: Float[Array, ""]
    """Angle of the screw θ₃ [rad]."""
    screw_displacement: Float[Array, ""]
    """Axial displacement of the screw x₀ [m]."""
    nut_displacement: Float[Array, ""]
    """Displacement of the nut x₂, zero at mid-stroke [m]."""
    slide_displacement: Float[Array, ""]
    """Displacement of the slide x₃, zero at mid-stroke [m]."""
    motor_speed: Float[Array, ""]
    """Speed of the motor [rad/s]."""
    end_speed: Float[Array, ""]
    """Speed of the screw's end [rad/s]."""
    screw_speed: Float[Array, ""]
    """Speed of the screw [rad/s]."""
    screw_velocity: Float[Array, ""]
    """Axial velocity of the screw [m/s]."""
    nut_velocity: Float[Array, ""]
    """Velocity of the nut [m/s]."""
    slide_velocity: Float[Array, ""]
    """Velocity of the slide [m/s]."""
    current: Float[Array, ""]
    """Current of the motor i [A]."""
    friction: PyTree[Array]
    """Internal state of the friction law."""
