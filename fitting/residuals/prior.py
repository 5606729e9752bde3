"""What is known of parameters before the data, as evidence: Gaussian, with means that may differ from fit to fit."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from fitting.residuals.residual import AbstractResidual
from twin._checks import InputError, above_zero, as_array, finite
from twin.paths import get_leaf


class GaussianPrior(AbstractResidual):
    """(value - mean) / standard deviation of some parameters of a model.

    `Parameter(prior=...)` says the same, but is part of the compiled program; this one is data.

    Raises:
        InputError: numbers of paths, means and deviations that differ, a mean that is not finite, a deviation that is
            not positive; when called, a path that the model does not have.
    """

    mean: Float[Array, "priors"] = eqx.field(converter=as_array)
    """Means, in the unit of each parameter."""
    deviation: Float[Array, "priors"] = eqx.field(converter=as_array)
    """Standard deviations, in the unit of each parameter."""
    paths: tuple[str, ...] = eqx.field(static=True)
    """Dotted paths into the model."""

    def __check_init__(self):
        finite("mean", self.mean)
        above_zero("deviation", self.deviation)
        if not hasattr(self.mean, "shape"):
            return
        if not self.mean.shape[-1:] == self.deviation.shape[-1:] == (len(self.paths),):
            raise InputError(
                f"There are {len(self.paths)} paths, means of shape {self.mean.shape} and deviations of shape "
                f"{self.deviation.shape}. Give one of each for every path."
            )

    def __call__(self, model: Any) -> Float[Array, "residuals"]:
        return (jnp.stack([get_leaf(model, path) for path in self.paths]) - self.mean) / self.deviation
