"""The position and velocity control of a numerically controlled axis, down to the voltage of its motor."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from twin._checks import InputError, above_zero, as_scalar, finite, is_concrete, not_negative
from twin.control.controller import AbstractController
from twin.drives.screw_travel import check_lead, travel_per_radian
from twin.laws import smooth_clip


class VelocityIntegral(NamedTuple):
    """State of a position controller over a PI velocity controller."""

    integral: Float[Array, ""]
    """Integral part I of the velocity controller [V]."""


class PositionVelocityPI(AbstractController):
    """P position controller with velocity feed-forward over a PI velocity controller of the motor.

    u = limit(k_p·e + I),  İ = k_i·e,  e = (k_v·(x_ref - x) + k_FF·ẋ_ref)/h - θ̇₁,  h = p/2π.

    The plant measures `motor_angle`, `motor_speed` and `position`; its command is a voltage. All gains are in SI units.
    Machine controllers often show k_v in 1/min; `twin.io.units.to_si(2725, "1/min", "1/s")` gives 45.4 1/s. It is no
    speed of rotation, therefore the "1/s" must be said.

    Raises:
        InputError: a gain that is negative or not finite, a lead of zero, a limit that is not above zero, an unknown
            feedback, anti-windup without velocity_gain.

    Source: Mauro, Pastorelli, Mohtar (2014), section 3.1 and Fig. 3; limit and anti-windup are ours.
    """

    position_gain: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Gain of the position controller k_v [1/s]."""
    velocity_gain: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Proportional gain of the velocity controller k_p [Vs/rad]."""
    integral_gain: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Integral gain of the velocity controller k_i [V/rad]."""
    lead: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Lead of the screw p: travel per turn [m]; negative for a left-hand screw."""
    feedforward: Float[Array, ""] = eqx.field(converter=as_scalar, default=1.0)
    """Part of the set velocity that is added behind the position controller k_FF [-]."""
    voltage_limit: Float[Array, ""] = eqx.field(converter=as_scalar, default=float("inf"))
    """Largest voltage that the amplifier gives [V]; with infinity the command is not touched."""
    feedback: str = eqx.field(static=True, default="motor")
    """Position that is controlled: "motor" for the encoder h·θ₁, "slide" for a linear scale."""
    anti_windup: bool = eqx.field(static=True, default=False)
    """Whether the integral is drawn back by what the limit takes away, over the reset time k_p/k_i; the paper has it
    not."""

    def __check_init__(self):
        not_negative("position_gain", self.position_gain, "1/s")
        not_negative("velocity_gain", self.velocity_gain, "Vs/rad")
        not_negative("integral_gain", self.integral_gain, "V/rad")
        finite("feedforward", self.feedforward)
        check_lead(self.lead)
        above_zero("voltage_limit", self.voltage_limit, "V")
        if self.feedback not in ("motor", "slide"):
            raise InputError(f'feedback must be "motor" or "slide", but is {self.feedback!r}. Choose one of the two.')
        if self.anti_windup and _is_zero(self.velocity_gain):
            raise InputError(
                "velocity_gain is 0 Vs/rad, but anti_windup draws the integral back over the reset time "
                "velocity_gain/integral_gain. Give a velocity_gain above zero, or leave anti_windup off."
            )

    def initial_state(self) -> VelocityIntegral:
        return VelocityIntegral(jnp.zeros(()))

    def vector_field(self, t: Float[Array, ""], state: Any, reference: Any, measurement: Any) -> VelocityIntegral:
        error = self.speed_error(reference, measurement)
        if self.anti_windup:
            wanted = self.velocity_gain * error + state.integral
            error = error + (self.limited(wanted) - wanted) / self.velocity_gain
        return VelocityIntegral(self.integral_gain * error)

    def command(self, t: Float[Array, ""], state: Any, reference: Any, measurement: Any) -> Float[Array, ""]:
        return self.limited(self.velocity_gain * self.speed_error(reference, measurement) + state.integral)

    def speed_error(self, reference: Any, measurement: Any) -> Float[Array, ""]:
        """Speed that the position controller asks for, less that of the motor: e [rad/s].

        Args:
            reference: the motion wanted.
            measurement: outputs of the axis.
        """
        h = travel_per_radian(self.lead)
        position = h * measurement.motor_angle if self.feedback == "motor" else measurement.position
        velocity = self.position_gain * (reference.position - position) + self.feedforward * reference.velocity
        return velocity / h - measurement.motor_speed

    def limited(self, voltage: Float[Array, ""]) -> Float[Array, ""]:
        """A voltage within the limit, smoothly [V].

        Args:
            voltage: voltage before the limit [V].
        """
        unlimited = jnp.isinf(self.voltage_limit)
        # An infinite limit must not reach the formula of the finite one: its derivative would be NaN.
        return jnp.where(unlimited, voltage, smooth_clip(voltage, jnp.where(unlimited, 1.0, self.voltage_limit)))


def _is_zero(value: Any) -> bool:
    return isinstance(value, Array) and is_concrete(value) and bool(np.all(np.asarray(value) == 0))
