"""Quantities that follow from the free parameters of a fit, and that a reader knows better than these."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from fitting.result import Estimate, FitResult
from twin.drives import CurrentDrivenAxis


def derived_of(result: FitResult) -> dict[str, Estimate]:
    """Quantities of a fitted model with standard errors, by name; empty for a model that has none.

    Args:
        result: the fit.
    """
    if not isinstance(getattr(result.model, "plant", result.model), CurrentDrivenAxis):
        return {}
    return {"inertia at the motor": _estimate(result, lambda m: getattr(m, "plant", m).motor_inertia, "kg m^2")}


def _estimate(result: FitResult, quantity: Callable[[Any], jax.Array], unit: str) -> Estimate:
    """A function of the model, its standard error by its slopes in the parameters that it depends on."""
    at = jnp.asarray(result.values)
    value, slopes = jax.value_and_grad(lambda x: quantity(result.space.with_values(result.model, x)))(at)
    used = np.flatnonzero(np.asarray(slopes))
    slope, covariance = np.asarray(slopes)[used], result.covariance[np.ix_(used, used)]
    return Estimate(float(value), float(np.sqrt(slope @ covariance @ slope)), unit)
