"""Which mode belongs to which reference mode, from how much each is like each."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

_Carry = tuple[Array, Array]


def best_first(alike: Float[Array, "references modes"]) -> Int[Array, "references"]:
    """The mode of each reference mode: the most alike pair first, each mode given away once.

    A pair of which both are each other's best would come up in any case, so all such pairs are taken at once: a few
    rounds do where one pair after the other would take as many as there are modes.

    Args:
        alike: likeness, at least zero; NaN counts as zero.

    Returns:
        Index of the mode of each reference mode; -1 where none was left.
    """
    references, modes = alike.shape

    def unfinished(carry: _Carry) -> Array:
        return jnp.sum(carry[1] >= 0) < min(references, modes)

    def take(carry: _Carry) -> _Carry:
        left, order = carry
        mode, reference = jnp.argmax(left, axis=1), jnp.argmax(left, axis=0)
        mutual = (reference[mode] == jnp.arange(references)) & (order < 0)
        given = mutual[:, None] & (mode[:, None] == jnp.arange(modes))
        gone = mutual[:, None] | jnp.any(given, axis=0)[None, :]
        return jnp.where(gone, -1.0, left), jnp.where(mutual, mode, order)

    # NaN would be the largest of all; modes that are NaN are paired last.
    start = (jnp.nan_to_num(jax.lax.stop_gradient(alike)), jnp.full(references, -1))
    return jax.lax.while_loop(unfinished, take, start)[1]
