"""Small dense least squares written out in JAX: no LAPACK call on a batch of tiny systems."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float


def least_squares_solve(matrix: Float[Array, "rows columns"], target: Float[Array, "rows"]) -> Float[Array, "columns"]:
    """min ‖A x - b‖ by Householder reflections, for a matrix of full column rank.

    Args:
        matrix: A, with at least as many rows as columns.
        target: b.

    Returns:
        x; not finite where the matrix has no full rank.
    """
    rows, columns = matrix.shape
    row = jnp.arange(rows)

    def reflect(j: Array, carry: tuple[Array, Array]) -> tuple[Array, Array]:
        a, b = carry
        below = jnp.where(row >= j, a[:, j], 0.0)
        norm = jnp.sqrt(jnp.sum(below**2))
        head = below[j]
        # The sign that avoids cancellation.
        v = jnp.where(row == j, head + jnp.where(head >= 0, norm, -norm), below)
        square = jnp.sum(v**2)
        scale = jnp.where(square > 0, 2.0 / jnp.where(square > 0, square, 1.0), 0.0)
        return a - scale * jnp.outer(v, v @ a), b - scale * v * (v @ b)

    a, b = jax.lax.fori_loop(0, columns, reflect, (matrix, target))

    def substitute(k: Array, x: Array) -> Array:
        j = columns - 1 - k
        return x.at[j].set((b[j] - a[j] @ x) / a[j, j])

    return jax.lax.fori_loop(0, columns, substitute, jnp.zeros(columns))


def bounded_least_squares(
    matrix: Float[Array, "rows columns"],
    target: Float[Array, "rows"],
    damping: Float[Array, "columns"],
    lower: Float[Array, "columns"],
    upper: Float[Array, "columns"],
) -> tuple[Float[Array, "columns"], Bool[Array, "columns"]]:
    """min ‖A x - b‖² + ‖damping·x‖² subject to lower ≤ x ≤ upper, by a primal active set from x = 0.

    Every iterate is within the bounds and none is worse than the one before: a variable that would leave is held at its
    bound, and the one whose bound holds back most is let go (Björck, "Numerical Methods for Least Squares Problems",
    1996, section 5.2.3).

    Args:
        matrix: A.
        target: b.
        damping: positive weights.
        lower: lower bounds, at most zero.
        upper: upper bounds, at least zero.

    Returns:
        x within the bounds, and which entries sit on a bound that holds them back.
    """
    columns = matrix.shape[1]
    normal = matrix.T @ matrix + jnp.diag(damping**2)
    gradient_at_zero = -matrix.T @ target
    # A multiplier is zero when it is rounding of the products that it is the sum of.
    rounding = 1e-14 * jnp.sqrt(jnp.diag(normal)) * jnp.sqrt(jnp.sum(target**2))

    # Bounds that meet leave nothing to decide.
    pinned = lower == upper

    def solve(x: Array, held: Array) -> Array:
        fixed = jnp.where(held, x, 0.0)
        kept = jnp.where(held, 0.0, 1.0)
        stacked = jnp.concatenate([matrix * kept, jnp.diag(jnp.where(held, 1.0, damping))])
        right = jnp.concatenate([target - matrix @ fixed, jnp.zeros(columns)])
        return jnp.where(held, fixed, least_squares_solve(stacked, right))

    def body(carry: tuple) -> tuple:
        x, at_lower, at_upper, _, count = carry
        held = at_lower | at_upper
        wanted = solve(x, held)
        step = wanted - x
        bound = jnp.where(step < 0, lower, upper)
        leaves = ~held & ((wanted < lower) | (wanted > upper))
        room = jnp.where(leaves, (bound - x) / jnp.where(leaves, step, 1.0), jnp.inf)
        first = jnp.arange(columns) == jnp.argmin(room)
        blocked = jnp.any(leaves)
        hit = blocked & first
        x = jnp.where(hit, bound, jnp.where(blocked, jnp.clip(x + jnp.min(room) * step, lower, upper), wanted))

        gradient = normal @ x + gradient_at_zero
        pull = jnp.where(at_lower, -gradient, jnp.where(at_upper, gradient, -jnp.inf)) - rounding
        worst = jnp.arange(columns) == jnp.argmax(pull / jnp.sqrt(jnp.diag(normal)))
        freed = ~blocked & worst & (pull > 0) & ~pinned
        at_lower = (at_lower | (hit & (step < 0))) & ~freed
        at_upper = (at_upper | (hit & (step > 0))) & ~freed
        return x, at_lower, at_upper, ~blocked & ~jnp.any(freed), count + 1

    def unsettled(carry: tuple) -> Bool[Array, ""]:
        _, _, _, settled, count = carry
        return ~settled & (count < 10 * columns)

    pushed_down = ((lower == 0) & (gradient_at_zero > 0)) | pinned
    pushed_up = (upper == 0) & (gradient_at_zero < 0) & ~pinned
    start = (jnp.zeros(columns), pushed_down, pushed_up, jnp.asarray(False), jnp.asarray(0))
    x, at_lower, at_upper, _, _ = jax.lax.while_loop(unsettled, body, start)
    return x, at_lower | at_upper
