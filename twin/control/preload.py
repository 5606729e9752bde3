"""Cascade control of two motors that are preloaded against each other by their torques."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from twin._checks import InputError, as_scalar, finite, is_concrete, not_negative, positive
from twin.control.controller import AbstractController
from twin.drives.rack_pinion import TorquePair
from twin.laws import smooth_clip


class CascadeGains(eqx.Module):
    """What a preload cascade is set to: Leipe et al., fig. 2.

    Velocities and positions are those of the table, or of the motors behind their gearboxes, in m/s and m.

    Raises:
        InputError: a gain that is negative or not finite, a time or torque that is not positive, a preload beyond the
            rated torque, an unknown feedback.
    """

    position_gain: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Gain of the common position controller K_v [1/s]."""
    velocity_gain: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Gain of each velocity controller K_p [Nm per m/s]."""
    reset_time: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Reset time of each velocity controller T_n [s]."""
    preload_gain: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Gain of the preload controller [m/s per Nm]."""
    preload: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Preload torque τ_p: half the difference of the two torques is brought to it [Nm]."""
    rated_torque: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Rated torque of the motors, which the preload must not exceed [Nm]."""
    torque_limit: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Largest torque that a velocity controller asks for; its integral follows what the limit leaves [Nm]."""
    velocity_feedforward: Float[Array, ""] = eqx.field(converter=as_scalar, default=1.0)
    """Part of the set velocity that is added behind the position controller [-]."""
    acceleration_feedforward: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Torque of each motor per set acceleration [Nm per m/s²]."""
    feedback: str = eqx.field(static=True, default="table")
    """Position that is controlled: "table" for the linear scale, "motors" for the mean of the motor encoders."""

    def __check_init__(self):
        for name in ("position_gain", "velocity_gain", "preload_gain"):
            not_negative(name, getattr(self, name))
        positive("reset_time", self.reset_time, "s")
        positive("rated_torque", self.rated_torque, "Nm")
        positive("torque_limit of the controller", self.torque_limit, "Nm")
        finite("preload", self.preload, "Nm")
        finite("velocity_feedforward", self.velocity_feedforward)
        finite("acceleration_feedforward", self.acceleration_feedforward)
        if self.feedback not in ("table", "motors"):
            raise InputError(f'feedback must be "table" or "motors", but is {self.feedback!r}. Choose one of the two.')
        _check_preload(self.preload, self.rated_torque)

    def correction(self, reference: Any, measurement: Any) -> Float[Array, ""]:
        """Velocity that the common position controller asks for [m/s].

        Args:
            reference: the motion wanted.
            measurement: outputs of the drive.
        """
        if self.feedback == "table":
            position = measurement.table_position
        else:
            position = 0.5 * (measurement.position_1 + measurement.position_2)
        return self.position_gain * (reference.position - position)

    def preload_velocity(self, torques: Any) -> Float[Array, ""]:
        """Velocity v_p that is added to motor 1 and taken from motor 2 [m/s].

        Args:
            torques: torques that the velocity controllers ask for.
        """
        return self.preload_gain * (self.preload - 0.5 * (torques.motor_1 - torques.motor_2))

    def limited(self, torque: Float[Array, ""]) -> Float[Array, ""]:
        """A torque within the controller's limit, smoothly [Nm].

        Args:
            torque: torque before the limit [Nm].
        """
        return smooth_clip(torque, self.torque_limit)


def _check_preload(preload: Any, rated_torque: Any) -> None:
    if not (is_concrete(preload) and is_concrete(rated_torque)):
        return
    if not all(isinstance(x, Array) for x in (preload, rated_torque)):
        return
    if abs(float(preload)) > float(rated_torque):
        raise InputError(
            f"preload is {float(preload):g} Nm, beyond the rated torque of {float(rated_torque):g} Nm: the motors "
            "could not hold it for long. Give a smaller preload; in per cent of the rated torque, at most 100."
        )


class PreloadState(NamedTuple):
    """State of a preload cascade."""

    integral_1: Float[Array, ""]
    """Integral part of the velocity controller of motor 1 [Nm]."""
    integral_2: Float[Array, ""]
    """Integral part of the velocity controller of motor 2 [Nm]."""


class PreloadCascade(AbstractController):
    """The preload cascade in continuous time.

    The preload controller feeds back what the velocity controllers ask for, which depends on what it gives: this
    algebraic loop is solved in closed form, before the torque limit.
    """

    gains: CascadeGains
    """What it is set to."""

    def initial_state(self) -> PreloadState:
        return PreloadState(jnp.zeros(()), jnp.zeros(()))

    def command(self, t: Float[Array, ""], state: Any, reference: Any, measurement: Any) -> TorquePair:
        wanted, _ = self._wanted(state, reference, measurement)
        return TorquePair(*(self.gains.limited(torque) for torque in wanted))

    def vector_field(self, t: Float[Array, ""], state: Any, reference: Any, measurement: Any) -> PreloadState:
        wanted, errors = self._wanted(state, reference, measurement)
        gains = self.gains
        rates = [
            (gains.velocity_gain * error + gains.limited(torque) - torque) / gains.reset_time
            for error, torque in zip(errors, wanted, strict=True)
        ]
        return PreloadState(*rates)

    def _wanted(self, state: Any, reference: Any, measurement: Any) -> tuple[TorquePair, tuple[Array, Array]]:
        """Torques before the limit, and velocity errors."""
        gains = self.gains
        common = gains.correction(reference, measurement) + gains.velocity_feedforward * reference.velocity
        ahead = gains.acceleration_feedforward * reference.acceleration
        error_1, error_2 = common - measurement.velocity_1, common - measurement.velocity_2
        torque_1 = gains.velocity_gain * error_1 + state.integral_1 + ahead
        torque_2 = gains.velocity_gain * error_2 + state.integral_2 + ahead
        loop = 1 + gains.preload_gain * gains.velocity_gain
        extra = gains.preload_velocity(TorquePair(torque_1, torque_2)) / loop
        push = gains.velocity_gain * extra
        return TorquePair(torque_1 + push, torque_2 - push), (error_1 + extra, error_2 - extra)
