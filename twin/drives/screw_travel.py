"""The lead of a screw."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, finite, is_concrete


def travel_per_radian(lead: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
    """Travel per angle h = p/2π of a screw [m/rad] (Mauro et al., eq. 11).

    Args:
        lead: travel per turn p [m].
    """
    return jnp.asarray(lead) / (2 * jnp.pi)


def check_lead(lead: Float[ArrayLike, ""]) -> None:
    """Raise unless a lead can turn rotation into travel. Traced values pass.

    Raises:
        InputError: if it is zero or not finite. A negative lead is that of a left-hand screw.
    """
    finite("lead of the screw", lead, "m")
    if isinstance(lead, jax.Array) and is_concrete(lead) and np.any(np.asarray(lead) == 0):
        raise InputError(
            "lead of the screw must not be zero [m]: such a screw turns without moving the slide. Give the travel per "
            "turn, 0.01 for 10 mm; negative for a left-hand screw."
        )
