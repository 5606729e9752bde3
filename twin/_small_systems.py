"""Small dense linear systems, many at once, written out in JAX.

LAPACK's batched factorisations share the thread pool of the program that calls them: two programs in loops of them wait
for each other for ever (trap 23). For the few unknowns of a drive this is faster as well, as all systems are eliminated
side by side.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Inexact

MOST = 24
"""Unknowns up to which systems are eliminated here, and beyond which LAPACK is called."""


def solve_many(
    matrices: Inexact[Array, "n n systems"], right: Inexact[Array, "n columns systems"]
) -> Inexact[Array, "n columns systems"]:
    """Solutions X of A·X = B for many systems; the last axis runs over them. Differentiable in both modes.

    Args:
        matrices: A.
        right: B.

    Returns:
        X; not finite, or huge by rounding, where A is singular.
    """
    if matrices.shape[0] > MOST:
        solution = jnp.linalg.solve(jnp.moveaxis(matrices, -1, 0), jnp.moveaxis(right, -1, 0))
        return jnp.moveaxis(solution, 0, -1)
    return _solve(matrices, right)


@jax.custom_jvp
def _solve(matrices: Array, right: Array) -> Array:
    return _product(_inverse(matrices), right)


@_solve.defjvp
def _solve_jvp(primals: tuple, tangents: tuple) -> tuple[Array, Array]:
    # dX = A⁻¹(dB - dA·X): the inverse serves all directions.
    (matrices, right), (d_matrices, d_right) = primals, tangents
    inverse = _inverse(matrices)
    solution = _product(inverse, right)
    return solution, _product(inverse, d_right - _product(d_matrices, solution))


def _product(left: Array, right: Array) -> Array:
    """A·B for each system; written as a sum, which a batch of tiny products is best at."""
    return jnp.sum(left[:, :, None] * right[None], axis=1)


def _inverse(matrices: Array) -> Array:
    """A⁻¹ by Gauss and Jordan's elimination, with row exchanges."""
    identity = jnp.broadcast_to(jnp.eye(matrices.shape[0], dtype=matrices.dtype)[..., None], matrices.shape)
    return eliminated(matrices, identity)


def eliminated(
    matrices: Inexact[Array, "n n systems"], right: Inexact[Array, "n columns systems"]
) -> Inexact[Array, "n columns systems"]:
    """Solutions by Gauss and Jordan's elimination with row exchanges, whatever the size, without LAPACK.

    Half the work of the inverse for one right-hand side.

    Args:
        matrices: A.
        right: B.
    """
    n = matrices.shape[0]
    row = jnp.arange(n)

    def eliminate(j: Array, work: Array) -> Array:
        column = work[:, j]
        size = jnp.abs(jnp.real(column)) + jnp.abs(jnp.imag(column))
        chosen = row[:, None] == jnp.argmax(jnp.where(row[:, None] >= j, size, -1.0), axis=0)
        pivot_row = jnp.sum(jnp.where(chosen[:, None], work, 0.0), axis=0)
        work = jnp.where(chosen[:, None], work[j], work)
        pivot_row = pivot_row / pivot_row[j]
        others = jnp.where((row == j)[:, None], 0.0, work[:, j])
        return (work - others[:, None] * pivot_row).at[j].set(pivot_row)

    return jax.lax.fori_loop(0, n, eliminate, jnp.concatenate([matrices, right], axis=1))[:, n:]


def solved_alone(matrix: Inexact[Array, "n n"], right: Inexact[Array, "n"]) -> Inexact[Array, "n"]:
    """The solution x of one system A·x = b, by the same elimination as `eliminated`, to the last bit.

    Rows stay where they are and are put in order at the end: where the caller batches single systems by `jax.vmap`,
    whose axis comes first, this takes half the time.

    Args:
        matrix: A.
        right: b.
    """
    n = right.size
    row = jnp.arange(n)

    def eliminate(j: Array, carry: tuple) -> tuple:
        work, free, order = carry
        column = work[:, j]
        size = jnp.abs(jnp.real(column)) + jnp.abs(jnp.imag(column))
        chosen = jnp.argmax(jnp.where(free, size, -1.0))
        here = row == chosen
        pivot_row = work[chosen] / column[chosen]
        work = jnp.where(here[:, None], pivot_row, work - column[:, None] * pivot_row)
        return work, free & ~here, jnp.where(row == j, chosen, order)

    begin = (jnp.concatenate([matrix, right[:, None]], axis=1), jnp.ones(n, dtype=bool), jnp.zeros_like(row))
    work, _, order = jax.lax.fori_loop(0, n, eliminate, begin)
    return work[:, n][order]
