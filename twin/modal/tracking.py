"""Modes followed by their shapes, where sorting by frequency would exchange them."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from twin.modal._assignment import best_first
from twin.modal.undamped import Modes


def likeness(modes: Modes, reference: Modes) -> Float[Array, "references modes"]:
    """Squared cosine between shapes in the measure of the reference's mass matrix: 1 for the same shape, 0 for another.

    The modal assurance criterion weighted by mass, so that shapes with angles and displacements can be compared.

    Args:
        modes: modes.
        reference: modes in the same degrees of freedom.
    """
    weighted = reference.mass @ reference.shapes
    cross = weighted.T @ modes.shapes
    own = jnp.einsum("im,ij,jm->m", modes.shapes, reference.mass, modes.shapes)
    return cross**2 / own[None, :]


def track(modes: Modes, reference: Modes) -> Modes:
    """The same modes in the order and with the signs of a reference: mode i is the one most like reference mode i.

    Each mode is given away once, the most alike pair first. Where modes cross on the way from the reference, a tracked
    mode keeps its shape and its frequency stays smooth. The pairing is not differentiated; frequencies and shapes are.
    The reference must be near enough for shapes to be told apart: go in steps along a path.

    Args:
        modes: modes to be put in order.
        reference: modes nearby, in the same degrees of freedom.

    Returns:
        The modes in the reference's order.
    """
    order = best_first(likeness(modes, reference))
    shapes = modes.shapes[:, order]
    along = jnp.einsum("im,ij,jm->m", reference.shapes, reference.mass, shapes)
    sign = jax.lax.stop_gradient(jnp.where(along < 0, -1.0, 1.0))
    return eqx.tree_at(
        lambda m: (m.frequency, m.damping_ratio, m.shapes, m.output_shapes, m.eigenvalues),
        modes,
        (
            modes.frequency[order],
            modes.damping_ratio[order],
            shapes * sign,
            modes.output_shapes[:, order] * sign,
            modes.eigenvalues[order],
        ),
    )
