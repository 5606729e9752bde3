"""A nonlinear programme with its published answer: minimise f(x) subject to h(x) = 0, g(x) ≥ 0 and bounds."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

Function = Callable[[Array], Array]
Numbers = float | Sequence[float] | np.ndarray


class NonlinearProgramme(NamedTuple):
    """Minimise `objective` subject to `equality` = 0, `inequality` ≥ 0 and `lower` ≤ x ≤ `upper`; no units."""

    name: str
    """Name in the source, such as HS71."""
    objective: Function
    """f, from x of shape (n,) to a scalar."""
    start: np.ndarray
    """Standard start, shape (n,); it may violate constraints and bounds."""
    lower: np.ndarray
    """Lower bounds, shape (n,); -inf where there is none."""
    upper: np.ndarray
    """Upper bounds, shape (n,); +inf where there is none."""
    equality: Function | None
    """h, from x to a vector that must be zero."""
    inequality: Function | None
    """g, from x to a vector that must not be negative."""
    optimum: float
    """f at `solution`, to nine digits or more."""
    solution: np.ndarray
    """A minimiser, shape (n,); others with the same f may exist."""


def programme(
    name: str,
    objective: Function,
    start: Numbers,
    *,
    lower: Numbers = -np.inf,
    upper: Numbers = np.inf,
    equality: Callable[[Array], object] | None = None,
    inequality: Callable[[Array], object] | None = None,
    optimum: float,
    solution: Numbers,
) -> NonlinearProgramme:
    """A programme from functions of the vector x.

    Args:
        name: name in the source.
        objective: from x to a scalar.
        start: standard start, shape (n,).
        lower: lower bounds, one for all or one for each variable.
        upper: upper bounds, likewise.
        equality: from x to the values that must be zero, as a vector or a list of scalars and vectors.
        inequality: from x to the values that must not be negative, likewise.
        optimum: published least value.
        solution: published minimiser, shape (n,).
    """
    start = np.asarray(start, float)

    def one_for_each(bound):
        return np.broadcast_to(np.asarray(bound, float), start.shape).copy()

    def vector(constraints):
        return None if constraints is None else lambda x: jnp.hstack(constraints(jnp.asarray(x)))

    return NonlinearProgramme(
        name=name,
        objective=lambda x: objective(jnp.asarray(x)),
        start=start,
        lower=one_for_each(lower),
        upper=one_for_each(upper),
        equality=vector(equality),
        inequality=vector(inequality),
        optimum=float(optimum),
        solution=np.asarray(solution, float),
    )


def spelled_out(
    name: str,
    objective: Callable[..., Array],
    start: Numbers,
    *,
    equality: Callable[..., object] | None = None,
    inequality: Callable[..., object] | None = None,
    **others,
) -> NonlinearProgramme:
    """A programme from functions of the single variables x1, x2, ..., as the source prints them.

    Args:
        name: name in the source.
        objective: from x1, x2, ... to a scalar.
        start: standard start, shape (n,).
        equality: from x1, x2, ... to the values that must be zero.
        inequality: from x1, x2, ... to the values that must not be negative.
        others: as for `programme`.
    """

    def of_vector(function):
        return None if function is None else lambda x: function(*x)

    return programme(
        name, of_vector(objective), start, equality=of_vector(equality), inequality=of_vector(inequality), **others
    )
