"""What a solver sees of a fit: the weighted residual and the constraints as functions of the scaled vector."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from fitting.constraints import AbstractConstraint, Equality, Inequality, constraint_values
from fitting.residuals.residual import AbstractResidual, evaluate
from twin.parameters import ParameterSpace


class Objective(eqx.Module):
    """Evidence about a model, seen as a function of the scaled vector of its free parameters."""

    residual: AbstractResidual
    """Evidence."""
    model: Any
    """Model that holds everything that is not free."""
    space: ParameterSpace
    """Free parameters."""
    constraints: tuple[AbstractConstraint, ...] = ()
    """General constraints."""

    def model_at(self, vector: Float[Array, "parameters"]) -> Any:
        """The model with its free parameters taken from the scaled vector."""
        return self.space.with_values(self.model, self.space.unscaled(vector))

    def __call__(
        self, vector: Float[Array, "parameters"]
    ) -> tuple[Float[Array, "residuals"], Float[Array, "data"] | None]:
        """The weighted residual with its priors, and the curvature of robust losses (None without)."""
        values = self.space.unscaled(vector)
        evidence, curvature = evaluate(self.residual, self.space.with_values(self.model, values))
        return jnp.concatenate([evidence, self.space.prior_residual(values)]), curvature

    def equality(self, vector: Float[Array, "parameters"]) -> Float[Array, "equalities"]:
        """Values that must be zero."""
        return constraint_values(self.constraints, self.model_at(vector), Equality)

    def inequality(self, vector: Float[Array, "parameters"]) -> Float[Array, "inequalities"]:
        """Values that must not be negative."""
        return constraint_values(self.constraints, self.model_at(vector), Inequality)


def residual_of(vector: Array, objective: Objective) -> tuple[Array, Any]:
    """The objective in the form of optimistix's least squares, with the curvature beside it."""
    return objective(vector)


def cost_of(vector: Array, objective: Objective) -> tuple[Array, None]:
    """Half the sum of squares, in the form of optimistix's minimisation."""
    return 0.5 * jnp.sum(objective(vector)[0] ** 2), None


def equality_of(vector: Array, objective: Objective) -> Array:
    """Values that must be zero, as `SLSQP` takes them."""
    return objective.equality(vector)


def inequality_of(vector: Array, objective: Objective) -> Array:
    """Values that must not be negative, as `SLSQP` takes them."""
    return objective.inequality(vector)
