"""Evidence of one's own: the first natural frequency of a two-mass drive, as bump tests give it."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from fitting.residuals.residual import AbstractResidual
from twin._checks import as_array, as_scalar, positive


class BumpTestResidual(AbstractResidual):
    """Natural frequency of a free two-mass drive, minus the measured ones, over its standard deviation."""

    frequency: Float[Array, "bumps"] = eqx.field(converter=as_array)
    """Frequency measured in each test [Hz]."""
    deviation: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Its standard deviation [Hz]."""

    def __check_init__(self):
        positive("frequency", self.frequency, "Hz")
        positive("deviation", self.deviation, "Hz")

    def __call__(self, model: Any) -> Float[Array, "residuals"]:
        inverse = 1 / model.motor_inertia + 1 / model.load_inertia
        found = jnp.sqrt(model.stiffness * inverse) / (2 * jnp.pi)
        return (found - self.frequency) / self.deviation
