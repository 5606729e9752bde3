"""The six directions of a node, and one number for each."""

import equinox as eqx
from jaxtyping import Array, Float

from twin._checks import as_scalar

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
"""Displacements, then rotations: x lateral, y vertical, z along the axis."""


class Directions(eqx.Module):
    """One number for each direction: stiffnesses [N/m, Nm/rad], or viscous or hysteretic dampings."""

    x: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Lateral [N/m; Ns/m viscous]."""
    y: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Vertical [N/m; Ns/m viscous]."""
    z: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Along the axis [N/m; Ns/m viscous]."""
    rx: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """About x [Nm/rad; Nms/rad viscous]."""
    ry: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """About y [Nm/rad; Nms/rad viscous]."""
    rz: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """About z [Nm/rad; Nms/rad viscous]."""
