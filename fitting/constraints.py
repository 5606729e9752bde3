"""General constraints on a model: equations and inequalities between its parameters or of what it does."""

import abc
from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from twin._checks import InputError


class AbstractConstraint(eqx.Module):
    """A condition on a model, as a smooth function of it; scaled so that a violation of 1e-8 is none."""

    function: eqx.AbstractVar[Callable[[Any], Array]]
    """From a model to one value or a vector of them."""

    @abc.abstractmethod
    def describe(self) -> str:
        """What is asked of the function's value."""


class Equality(AbstractConstraint):
    """function(model) = 0."""

    function: Callable[[Any], Array]
    """From a model to one value or a vector of them, of the order of one."""

    def describe(self) -> str:
        return "= 0"


class Inequality(AbstractConstraint):
    """function(model) ≥ 0."""

    function: Callable[[Any], Array]
    """From a model to one value or a vector of them, of the order of one."""

    def describe(self) -> str:
        return ">= 0"


def constraint_values(
    constraints: Sequence[AbstractConstraint], model: Any, kind: type[AbstractConstraint]
) -> Float[Array, "values"]:
    """Values of all constraints of one kind, stacked.

    Args:
        constraints: the constraints.
        model: the model.
        kind: `Equality` or `Inequality`.
    """
    values = [jnp.ravel(jnp.asarray(c.function(model))) for c in constraints if isinstance(c, kind)]
    return jnp.concatenate([jnp.zeros(0), *values])


def all_constraints(constraints: Any) -> tuple[AbstractConstraint, ...]:
    """The constraints that a caller gave, as a tuple.

    Args:
        constraints: any number of constraints, one after the other.

    Raises:
        InputError: a constraint by itself.
    """
    if isinstance(constraints, AbstractConstraint):
        raise InputError(
            f"constraints is a single {type(constraints).__name__}. Put it into a list: constraints=[constraint]."
        )
    return tuple(constraints)


def check_constraints(constraints: Sequence[AbstractConstraint], model: Any) -> None:
    """Raise unless every constraint is a function of the model that returns real numbers, one or a vector.

    Args:
        constraints: the constraints.
        model: a model.

    Raises:
        InputError: naming the constraint by its number.
    """
    for i, constraint in enumerate(constraints):
        if not isinstance(constraint, AbstractConstraint):
            raise InputError(
                f"Constraint {i} is a {type(constraint).__name__}. Write Equality(function) or Inequality(function)."
            )
        shape = jax.eval_shape(eqx.filter_jit(constraint.function), model)
        if not (isinstance(shape, jax.ShapeDtypeStruct) and len(shape.shape) <= 1):
            raise InputError(
                f"Constraint {i} returns {getattr(shape, 'shape', type(shape).__name__)}; return a number or a vector."
            )
        if not jnp.issubdtype(shape.dtype, jnp.floating):
            raise InputError(f"Constraint {i} returns {shape.dtype} values; return real numbers, not a comparison.")
