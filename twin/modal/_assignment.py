"""Which mode belongs to which reference mode, from how much each is like each."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int


def best_first(alike: Float[Array, "references modes"]) -> Int[Array, "references"]:
    """The mode of each reference mode: the most alike pair first, each mode given away once.

    Args:
        alike: likeness, at least zero; NaN counts as zero.

    Returns:
        Index of the mode of each reference mode; -1 where none was left.
    """
    references, number = alike.shape

    def pair(_: Array, carry: tuple[Array, Array]) -> tuple[Array, Array]:
        left, order = carry
        row, column = jnp.unravel_index(jnp.argmax(left), left.shape)
        return left.at[row].set(-1.0).at[:, column].set(-1.0), order.at[row].set(column)

    # NaN would be the largest of all; modes that are NaN are paired last.
    start = (jnp.nan_to_num(jax.lax.stop_gradient(alike)), jnp.full(references, -1))
    return jax.lax.fori_loop(0, min(references, number), pair, start)[1]
