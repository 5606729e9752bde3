"""A rigid mass fixed to a node: a motor, a coupling's half, what a reduction left out."""

import equinox as eqx
from jaxtyping import Array, Float

from twin._checks import as_scalar, not_negative


class LumpedMass(eqx.Module):
    """A rigid body with its centre of mass at a node of a component.

    Raises:
        InputError: a negative or non-finite value.
    """

    mass: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Mass m [kg]."""
    component: str = eqx.field(static=True)
    """Name of the component."""
    node: str = eqx.field(static=True)
    """Name of the node."""
    inertia_x: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Moment of inertia about x [kg m²]."""
    inertia_y: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Moment of inertia about y [kg m²]."""
    inertia_z: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Moment of inertia about z [kg m²]."""

    def __check_init__(self):
        not_negative("mass", self.mass, "kg")
        not_negative("inertia_x", self.inertia_x, "kg m²")
        not_negative("inertia_y", self.inertia_y, "kg m²")
        not_negative("inertia_z", self.inertia_z, "kg m²")
