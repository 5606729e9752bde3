"""What each damping source adds to each mode's damping ratio."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, as_array, finite, require_x64
from twin.modal.undamped import Modes

_KINDS = ("viscous", "hysteretic")


def damping_contributions(
    modes: Modes,
    vectors: Float[ArrayLike, "dofs vectors"],
    kind: str | Sequence[str],
    *,
    sources: Sequence[int] | None = None,
) -> Float[Array, "modes sources"]:
    """Factors Q of the modal damping ratios that damping sources cause: ζ = ζ_other + Q·p; differentiable.

    A source of size p adds p·Σ b·bᵀ to the viscous or the hysteretic damping matrix, b its connection vectors: +1 and
    -1 for a damper between two degrees of freedom. Then Q = Σ (bᵀφ)²/(2ω) if it is viscous, Σ (bᵀφ)²/(2ω²) if
    hysteretic, and ζ is exactly the damping ratio of `modes`.

    Args:
        modes: modes.
        vectors: connection vectors b in the degrees of freedom, one per column.
        kind: "viscous" (p in Ns/m or Nms/rad) or "hysteretic" (p in N/m or Nm/rad), for all sources or for each one.
        sources: number of the source, from 0, that each vector belongs to, where one acts at several places; each
            vector is a source of its own if not given.

    Returns:
        Q [1/unit of p]; 0 for a rigid-body mode, whose damping ratio is zero for want of a definition.

    Raises:
        InputError: 64-bit mode off, vectors of another length than the shapes, an entry that is not finite, an unknown
            kind, another number of kinds than sources, a source without a vector.

    Source: eq. 12 of J. Ellinger, M. F. Zaeh, Machines 10 (2022) 535.
    """
    require_x64()
    b = as_array(vectors)
    dofs = modes.shapes.shape[0]
    if b.ndim != 2 or b.shape[0] != dofs:
        raise InputError(
            f"vectors must have one row for each of {dofs} degrees of freedom, but their shape is {b.shape}."
        )
    finite("vectors", b)
    owner = np.arange(b.shape[1]) if sources is None else np.asarray(sources, dtype=int)
    number = int(owner.max()) + 1 if owner.size else 0
    if owner.shape != (b.shape[1],) or set(owner.tolist()) != set(range(number)):
        raise InputError(
            f"sources must give each of {b.shape[1]} vectors the number of its source, 0, 1, ... without a gap, but is "
            f"{owner.tolist()}."
        )
    kinds = (kind,) * number if isinstance(kind, str) else tuple(kind)
    if len(kinds) != number or not set(kinds) <= set(_KINDS):
        raise InputError(
            f"kind must be {' or '.join(_KINDS)}, for all or for each of {number} sources, but is {kind!r}."
        )

    grouping = np.zeros((b.shape[1], number))
    grouping[np.arange(b.shape[1]), owner] = 1.0
    strokes = (modes.shapes.T @ b) ** 2 @ grouping
    omega = (2 * jnp.pi * modes.frequency)[:, None]
    moving = omega > 0
    safe = jnp.where(moving, omega, 1.0)
    hysteretic = np.array([name == "hysteretic" for name in kinds])
    factor = jnp.where(hysteretic, 1 / (2 * safe**2), 1 / (2 * safe))
    # NaN, of an unstable mode, stays NaN.
    return jnp.where(moving, strokes * factor, 0.0 * omega)
