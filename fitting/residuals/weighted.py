"""Evidence whose residual is scaled: weights known up to a common factor, next to other evidence."""

from typing import Any

import equinox as eqx
from jaxtyping import Array, Float

from fitting.residuals.residual import AbstractResidual
from twin._checks import as_scalar, positive


class Weighted(AbstractResidual):
    """A residual over a common factor of its standard deviations.

    Raises:
        InputError: if the factor is not positive.
    """

    residual: AbstractResidual
    """The evidence."""
    deviation: Float[Array, ""] = eqx.field(converter=as_scalar)
    """By how much all of its standard deviations are too small [-]; the rms that its own fit leaves."""

    def __check_init__(self):
        positive("deviation", self.deviation)

    def __call__(self, model: Any) -> Float[Array, "residuals"]:
        return self.residual(model) / self.deviation
