"""Evidence whose residual is scaled: weights known up to a common factor, next to other evidence."""

from typing import Any

import equinox as eqx
from jaxtyping import Array, Float

from fitting.residuals.residual import AbstractResidual
from twin._checks import above_zero, as_scalar


class Weighted(AbstractResidual):
    """A residual over a common factor of its standard deviations. An infinite one leaves the evidence out.

    Raises:
        InputError: if the factor is not above zero.
    """

    residual: AbstractResidual
    """The evidence."""
    deviation: Float[Array, ""] = eqx.field(converter=as_scalar)
    """By how much all of its standard deviations are too small [-]; the rms that its own fit leaves."""

    def __check_init__(self):
        above_zero("deviation", self.deviation)

    def __call__(self, model: Any) -> Float[Array, "residuals"]:
        return self.residual(model) / self.deviation
