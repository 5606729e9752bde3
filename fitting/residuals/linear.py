"""Evidence that is linear in the free parameters."""

from typing import Any

import equinox as eqx
from jaxtyping import Array, Float

from fitting.residuals.residual import AbstractResidual
from twin._checks import InputError, as_array, finite
from twin.parameters import ParameterSpace


class LinearResidual(AbstractResidual):
    """W·x - y, with x the values of some parameters in SI; its rows are in the order of time."""

    regressors: Float[Array, "rows parameters"] = eqx.field(converter=as_array)
    """Regressor matrix W, one column per parameter."""
    target: Float[Array, "rows"] = eqx.field(converter=as_array)
    """Measured y."""
    space: ParameterSpace
    """The parameters that the columns belong to."""
    name: str = eqx.field(static=True, default="target")
    """Name of what was measured."""

    def __check_init__(self):
        rows, columns = self.regressors.shape
        if self.target.shape != (rows,) or columns != len(self.space):
            raise InputError(
                f"regressors of shape {self.regressors.shape} do not fit {self.target.shape[0]} measured values and "
                f"{len(self.space)} parameters."
            )
        finite("regressors", self.regressors)
        finite("target", self.target)

    def __call__(self, model: Any) -> Float[Array, "rows"]:
        return self.regressors @ self.space.values(model) - self.target
