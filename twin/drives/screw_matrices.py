"""Mass, stiffness and damping matrices of a ball screw axis."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from twin.drives.screw_springs import PerSpring


class ScrewMatrices(NamedTuple):
    """M·Ẍ + B·Ẋ + K·X = F for X = (θ₁, θ₂, θ₃, x₀, x₂, x₃) (Mauro et al., eq. 15, 16)."""

    mass: Float[Array, "6 6"]
    """M, three inertias [kg m²] and three masses [kg] on the diagonal."""
    stiffness: Float[Array, "6 6"]
    """K, entries [Nm/rad], [N] and [N/m]."""
    damping: Float[Array, "6 6"]
    """B, entries [Nms/rad], [Ns] and [Ns/m]."""


def spring_matrix(values: PerSpring, travel_per_radian: Float[Array, ""]) -> Float[Array, "6 6"]:
    """The pattern that stiffness and damping share (Mauro et al., eq. 18).

    Args:
        values: stiffness or viscous coefficient of each spring.
        travel_per_radian: h [m/rad].
    """
    a, b, c, d, e = values
    h, o = travel_per_radian, jnp.zeros(())
    rows = (
        (a, -a, o, o, o, o),
        (-a, a + b, -b, o, o, o),
        (o, -b, b + h**2 * d, h * d, -h * d, o),
        (o, o, h * d, c + d, -d, o),
        (o, o, -h * d, -d, d + e, -e),
        (o, o, o, o, -e, e),
    )
    return jnp.stack([jnp.stack(row) for row in rows])
