"""The preload cascade as a drive computes it: once per tick, the position controller less often, velocities by
differences of the encoders, torques that act one tick later."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from twin._checks import InputError, is_concrete
from twin.control.controller import AbstractSampledController
from twin.control.preload import CascadeGains
from twin.drives.rack_pinion import TorquePair


class SampledPreloadMemory(NamedTuple):
    """Memory of a sampled preload cascade."""

    integral_1: Float[Array, ""]
    """Integral part of the velocity controller of motor 1 [Nm]."""
    integral_2: Float[Array, ""]
    """Integral part of the velocity controller of motor 2 [Nm]."""
    position_1: Float[Array, ""]
    """Position of motor 1 behind its gearbox, one tick ago [m]."""
    position_2: Float[Array, ""]
    """Position of motor 2 behind its gearbox, one tick ago [m]."""
    correction: Float[Array, ""]
    """What the position controller asked for at its last tick, held since [m/s]."""
    asked: TorquePair
    """Torques asked for at the last tick [Nm]."""
    tick: Float[Array, ""]
    """Ticks since the last one of the position controller, a whole number [-]."""


class SampledPreloadCascade(AbstractSampledController):
    """The preload cascade, sampled.

    The preload controller uses the torques of the tick before, so that there is no algebraic loop. Velocities are
    differences of the encoder positions over one tick; the axis is taken to have moved evenly before the start.

    Raises:
        InputError: fewer than one tick per tick of the position controller; gains of preload and velocity controller
            whose product is 1 or more, so that each tick would answer the one before by more than it corrects.
    """

    gains: CascadeGains
    """What it is set to."""
    position_every: int = eqx.field(static=True, default=1)
    """Ticks of the velocity controllers for each of the position controller."""
    delayed: bool = eqx.field(static=True, default=False)
    """Whether a torque acts one tick after it is computed."""

    def __check_init__(self):
        if self.position_every < 1:
            raise InputError(f"position_every must be at least 1, but is {self.position_every}. Give a whole number.")
        product = getattr(self.gains, "preload_gain", None), getattr(self.gains, "velocity_gain", None)
        if all(isinstance(gain, Array) and is_concrete(gain) and gain.ndim == 0 for gain in product):
            loop = float(self.gains.preload_gain * self.gains.velocity_gain)
            if loop >= 1:
                raise InputError(
                    f"preload_gain times velocity_gain is {loop:g}, but must stay below 1: the preload controller sees "
                    "torques of the tick before, and would swing up. Lower the preload_gain."
                )

    def initial_state(self, measurement: Any, period: Float[Array, ""]) -> SampledPreloadMemory:
        zero = jnp.zeros(())
        return SampledPreloadMemory(
            integral_1=zero,
            integral_2=zero,
            position_1=measurement.position_1 - period * measurement.velocity_1,
            position_2=measurement.position_2 - period * measurement.velocity_2,
            correction=zero,
            asked=TorquePair(zero, zero),
            tick=zero,
        )

    def update(
        self, state: Any, reference: Any, measurement: Any, period: Float[Array, ""]
    ) -> tuple[SampledPreloadMemory, TorquePair]:
        gains = self.gains
        correction = jnp.where(state.tick < 0.5, gains.correction(reference, measurement), state.correction)
        common = correction + gains.velocity_feedforward * reference.velocity
        ahead = gains.acceleration_feedforward * reference.acceleration
        extra = gains.preload_velocity(state.asked)
        asked, integrals = [], []
        for position, before, integral, sign in (
            (measurement.position_1, state.position_1, state.integral_1, 1.0),
            (measurement.position_2, state.position_2, state.integral_2, -1.0),
        ):
            error = common + sign * extra - (position - before) / period
            torque = gains.velocity_gain * error + integral + ahead
            limited = gains.limited(torque)
            asked.append(limited)
            gained = gains.velocity_gain * error + limited - torque
            integrals.append(integral + gained * period / gains.reset_time)
        after = SampledPreloadMemory(
            integral_1=integrals[0],
            integral_2=integrals[1],
            position_1=measurement.position_1,
            position_2=measurement.position_2,
            correction=correction,
            asked=TorquePair(*asked),
            tick=(state.tick + 1) % self.position_every,
        )
        return after, state.asked if self.delayed else after.asked
