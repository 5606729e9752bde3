"""Triangular factors of small matrices, written out in JAX so that a batch of them is one loop over columns."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


def triangular_factor(matrix: Float[Array, "rows columns"]) -> Float[Array, "columns columns"]:
    """Upper triangular R with RᵀR = AᵀA and a diagonal that is not negative, by Householder reflections.

    Args:
        matrix: A, with at least as many rows as columns.
    """
    rows, columns = matrix.shape
    row = jnp.arange(rows)

    def reflect(j: Array, a: Array) -> Array:
        below = jnp.where(row >= j, a[:, j], 0.0)
        largest = jnp.max(jnp.abs(below))
        # Scaled, so that squares of very small or large entries do not vanish or overflow.
        below = below / jnp.where(largest > 0, largest, 1.0)
        head, norm = below[j], jnp.sqrt(jnp.sum(below**2))
        v = jnp.where(row == j, head + jnp.where(head >= 0, norm, -norm), below)
        square = jnp.sum(v**2)
        scale = jnp.where(square > 0, 2.0 / jnp.where(square > 0, square, 1.0), 0.0)
        return a - scale * jnp.outer(v, v @ a)

    factor = jnp.triu(jax.lax.fori_loop(0, columns, reflect, matrix)[:columns])
    return factor * jnp.where(jnp.diag(factor) < 0, -1.0, 1.0)[:, None]


def solve_upper(triangle: Float[Array, "n n"], target: Float[Array, "n"]) -> Float[Array, "n"]:
    """x of R·x = b by back substitution.

    Args:
        triangle: R, upper triangular.
        target: b.
    """
    n = target.size

    def substitute(k: Array, x: Array) -> Array:
        j = n - 1 - k
        return x.at[j].set((target[j] - triangle[j] @ x) / triangle[j, j])

    return jax.lax.fori_loop(0, n, substitute, jnp.zeros(n))


def inverse_of_lower(triangle: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """L⁻¹ of a lower triangular matrix, row by row.

    Args:
        triangle: L.
    """
    n = triangle.shape[0]
    eye = jnp.eye(n)

    def row(i: Array, inverse: Array) -> Array:
        return inverse.at[i].set((eye[i] - triangle[i] @ inverse) / triangle[i, i])

    return jax.lax.fori_loop(0, n, row, jnp.zeros((n, n)))
