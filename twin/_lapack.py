"""Whether a program calls LAPACK, whose batched factorisations make programs on several threads wait for ever."""

from collections.abc import Callable, Iterator
from typing import Any

import equinox as eqx
import jax

LAPACK = frozenset(
    [
        "lu",
        "cholesky",
        "qr",
        "geqrf",
        "geqp3",
        "householder_product",
        "eigh",
        "eig",
        "svd",
        "schur",
        "hessenberg",
        "tridiagonal",
        "tridiagonal_solve",
        "triangular_solve",
    ]
)
"""Primitives of JAX that are one call of LAPACK for each matrix of a batch."""


def calls_lapack(function: Callable, *arguments: Any) -> bool:
    """Whether a factorisation by LAPACK is part of a function, however deep inside.

    Args:
        function: any function that JAX can trace.
        arguments: of the function.
    """
    return any(equation.primitive.name in LAPACK for equation in equations_of(traced(function, *arguments)))


def traced(function: Callable, *arguments: Any) -> Any:
    """The program that JAX makes of a function; only its arrays are arguments and results."""
    arrays, rest = eqx.partition(arguments, eqx.is_array)
    made = jax.make_jaxpr(lambda arrays: eqx.filter(function(*eqx.combine(arrays, rest)), eqx.is_array))(arrays)
    return made.jaxpr


def equations_of(jaxpr: Any) -> Iterator[Any]:
    """All equations of a traced program, those inside of loops and branches too."""
    for equation in jaxpr.eqns:
        yield equation
        for value in jax.tree.leaves(list(equation.params.values()), is_leaf=lambda value: hasattr(value, "eqns")):
            if hasattr(value, "eqns"):
                yield from equations_of(value)
