"""Whether a function calls LAPACK, whose batched factorisations make programs on several threads wait for ever."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax

_LAPACK = frozenset(
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
    arrays, rest = eqx.partition(arguments, eqx.is_array)
    traced = jax.make_jaxpr(lambda arrays: eqx.filter(function(*eqx.combine(arrays, rest)), eqx.is_array))(arrays)
    return _mentions(traced.jaxpr)


def _mentions(jaxpr: Any) -> bool:
    for equation in jaxpr.eqns:
        inner = jax.tree.leaves(list(equation.params.values()), is_leaf=lambda value: hasattr(value, "eqns"))
        if equation.primitive.name in _LAPACK or any(_mentions(value) for value in inner if hasattr(value, "eqns")):
            return True
    return False
