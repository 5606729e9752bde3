"""A controller of one's own: PID on the position, computed once per tick."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from twin._checks import as_scalar, not_negative
from twin.control import AbstractSampledController


class PidMemory(NamedTuple):
    """What is kept from tick to tick."""

    integral: Float[Array, ""]
    """Integral of the error [rad s]."""
    error: Float[Array, ""]
    """Error one tick ago [rad]."""


class SampledPid(AbstractSampledController):
    """u = kp·e + ki·∫e + kd·(e - e₋₁)/T."""

    proportional: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Gain kp [A/rad]."""
    integral: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Gain ki [A/(rad s)]."""
    derivative: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Gain kd [A s/rad]."""

    def __check_init__(self):
        for name in ("proportional", "integral", "derivative"):
            not_negative(name, getattr(self, name))

    def initial_state(self, measurement: Any, period: Float[Array, ""]) -> PidMemory:
        return PidMemory(jnp.zeros(()), jnp.zeros(()))

    def update(
        self, state: Any, reference: Any, measurement: Any, period: Float[Array, ""]
    ) -> tuple[PidMemory, Float[Array, ""]]:
        error = reference.position - measurement.position
        integral = state.integral + period * error
        rate = (error - state.error) / period
        command = self.proportional * error + self.integral * integral + self.derivative * rate
        return PidMemory(integral, error), command
