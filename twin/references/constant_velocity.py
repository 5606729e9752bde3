"""Travel at a constant velocity after a smooth start."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import as_scalar, finite, positive
from twin.references.reference import AbstractReference, MotionPoint


class ConstantVelocity(AbstractReference):
    """From rest to a constant velocity by a half-cosine ramp, and on at that velocity for ever.

    During the ramp, at the time τ since the start, the velocity is V·(1 - cos(πτ/R))/2; position and acceleration are
    its exact integral and derivative, and continuous. Before the start the axis stands at its start position.

    Raises:
        InputError: if the ramp takes no time, or a value is not finite.
    """

    velocity: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Velocity V after the ramp, of either sign [m/s or rad/s]."""
    ramp_time: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Time R from rest to the constant velocity [s]."""
    start_time: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Time at which the ramp begins [s]."""
    start_position: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Position before the ramp [m or rad]."""

    def __check_init__(self):
        finite("velocity", self.velocity, "m/s")
        positive("ramp_time", self.ramp_time, "s")
        finite("start_time", self.start_time, "s")
        finite("start_position", self.start_position, "m")

    def __call__(self, t: Float[ArrayLike, ""]) -> MotionPoint:
        elapsed = t - self.start_time
        steady = elapsed >= self.ramp_time
        since_start = jnp.where(elapsed < 0, 0.0, elapsed)
        in_ramp = jnp.where(steady, self.ramp_time, since_start)
        rate = jnp.pi / self.ramp_time
        angle = rate * in_ramp
        ramped = 0.5 * (in_ramp - jnp.sin(angle) / rate)
        return MotionPoint(
            self.start_position + self.velocity * jnp.where(steady, elapsed - 0.5 * self.ramp_time, ramped),
            self.velocity * jnp.where(steady, 1.0, 0.5 * (1 - jnp.cos(angle))),
            self.velocity * jnp.where(steady, 0.0, 0.5 * rate * jnp.sin(angle)),
        )

    def switching_times(self) -> Float[Array, "2"]:
        """Start and end of the ramp, at which the jerk jumps [s]."""
        return jnp.stack([self.start_time, self.start_time + self.ramp_time])
