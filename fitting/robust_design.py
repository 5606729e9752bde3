"""Designs that hold over a spread of what the model does not know exactly."""

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, as_array, as_scalar, finite, not_negative, positive
from twin.paths import get_leaf, set_leaves

# Below this the standard deviation is rounded off: its derivative is finite where all variants cost the same.
_ROUNDING = 1e-9


class Variations(eqx.Module):
    """Variants of a model: every combination of factors on some of its numbers.

    Raises:
        InputError: no path, a factor that is not finite, a path without factors.
    """

    paths: tuple[str, ...] = eqx.field(static=True)
    """Dotted paths of what varies."""
    factors: Float[Array, "variants paths"] = eqx.field(converter=as_array)
    """Factors on the model's own values, one row per variant [-]."""

    def __init__(self, factors: Mapping[str, Float[ArrayLike, "factors"] | Sequence[float]]):
        self.paths = tuple(factors)
        rows = [np.atleast_1d(np.asarray(values, dtype=float)) for values in factors.values()]
        if not rows or any(row.ndim != 1 or row.size == 0 for row in rows):
            raise InputError('variations need at least one path with a vector of factors: {"plant.mass": [0.8, 1.2]}.')
        for path, row in zip(self.paths, rows, strict=True):
            finite(f"factors of {path}", row)
        self.factors = as_array(np.asarray(list(itertools.product(*rows))))

    def evaluate(self, function: Callable[[Any], Array], model: Any) -> Float[Array, "variants ..."]:
        """A function of all variants of a model, in one batch.

        Args:
            function: of a model.
            model: the model whose values the factors multiply.

        Raises:
            InputError: a path that is not in the model.
        """
        own = jnp.stack([jnp.asarray(get_leaf(model, path)) for path in self.paths])
        return jax.vmap(lambda row: function(set_leaves(model, {path: row[i] for i, path in enumerate(self.paths)})))(
            self.factors * own
        )


class RobustObjective(eqx.Module):
    """Cost over a spread of models: mean + spread·standard deviation, or a smooth worst case.

    A variant whose simulation fails costs NaN, and so does the design.

    Raises:
        InputError: a spread that is negative, a width that is not positive, and as `Variations`.
    """

    objective: Callable[[Any], Array]
    """Cost of one model."""
    variations: Variations
    """The variants, all with the same weight."""
    spread: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Weight of the standard deviation [-]."""
    worst_case: Float[Array, ""] | None
    """If given, the cost is w·ln Σexp(C/w) with this width w in the unit of the cost: never below the worst variant and
    at most w·ln(variants) above."""

    def __init__(
        self,
        objective: Callable[[Any], Array],
        variations: Variations | Mapping[str, Float[ArrayLike, "factors"] | Sequence[float]],
        *,
        spread: ArrayLike = 1.0,
        worst_case: ArrayLike | None = None,
    ):
        self.objective = objective
        self.variations = variations if isinstance(variations, Variations) else Variations(variations)
        self.spread = as_scalar(spread)
        self.worst_case = None if worst_case is None else as_scalar(worst_case)
        not_negative("spread", self.spread)
        if self.worst_case is not None:
            positive("width of the worst case", self.worst_case)

    def costs(self, model: Any) -> Float[Array, "variants"]:
        """Cost of each variant.

        Args:
            model: the model that is varied.
        """
        return self.variations.evaluate(self.objective, model)

    def __call__(self, model: Any) -> Float[Array, ""]:
        costs = self.costs(model)
        if self.worst_case is not None:
            return self.worst_case * jax.nn.logsumexp(costs / self.worst_case)
        mean = jnp.mean(costs)
        return mean + self.spread * jnp.sqrt(jnp.mean((costs - mean) ** 2) + _ROUNDING**2)


class RobustLimit(eqx.Module):
    """The values of a constraint's function for all variants: Inequality(RobustLimit(function, variations)) holds for
    each of them."""

    function: Callable[[Any], Array]
    """Function of one model, as of a constraint."""
    variations: Variations
    """The variants."""

    def __call__(self, model: Any) -> Float[Array, "values"]:
        return jnp.ravel(self.variations.evaluate(self.function, model))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the values: those of the function, with the number of the variant."""
        own = getattr(self.function, "names", (getattr(self.function, "__name__", "constraint"),))
        return tuple(f"{name}, variant {i}" for i in range(self.variations.factors.shape[0]) for name in own)
