"""A sampled position controller with an inner velocity controller, both proportional."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from twin._checks import above_zero, as_scalar, not_negative
from twin.control.controller import AbstractSampledController


class EncoderMemory(NamedTuple):
    """Encoder positions of the last ticks."""

    previous: Float[Array, ""]
    """Position one tick ago [m or rad]."""
    before: Float[Array, ""]
    """Position two ticks ago [m or rad]."""


class SampledPositionVelocity(AbstractSampledController):
    """P position controller over P velocity controller with a differentiated encoder signal and a limited command.

    u = limit(kp·kv·(q_r - q) - kv·q̇), where q̇ is the backward difference of the two-sample mean of q, that is
    (q_k - q_{k-2}) / 2T. This is the controller of the EMPS bench (Janot, Gautier, Brunot 2019).
    """

    position_gain: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Position loop gain kp [1/s]."""
    velocity_gain: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Velocity loop gain kv [command unit per m/s]."""
    command_limit: Float[Array, ""] = eqx.field(converter=as_scalar, default=float("inf"))
    """Largest magnitude of the command [command unit]."""
    history: EncoderMemory | None = None
    """Encoder positions at the two ticks before the start, where a record tells them; else steady motion is assumed."""

    def __check_init__(self):
        not_negative("position_gain", self.position_gain, "1/s")
        not_negative("velocity_gain", self.velocity_gain)
        above_zero("command_limit", self.command_limit)

    def initial_state(self, measurement: Any, period: Float[Array, ""]) -> EncoderMemory:
        if self.history is not None:
            return self.history
        # The axis is taken to have moved at its initial speed before the record began.
        travelled = measurement.velocity * period
        return EncoderMemory(measurement.position - travelled, measurement.position - 2 * travelled)

    def update(
        self, state: Any, reference: Any, measurement: Any, period: Float[Array, ""]
    ) -> tuple[EncoderMemory, Float[Array, ""]]:
        position = measurement.position
        velocity = (position - state.before) / (2 * period)
        command = self.velocity_gain * (self.position_gain * (reference.position - position) - velocity)
        limited = jnp.clip(command, -self.command_limit, self.command_limit)
        return EncoderMemory(position, state.previous), limited
