"""A friction law of one's own: F = F_c (2/π) atan(v/w) + F_v v."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import as_scalar, not_negative, positive
from twin.laws import AbstractStaticFriction


class ArctanFriction(AbstractStaticFriction):
    """Coulomb friction turned around by an arc tangent, with viscous friction."""

    coulomb: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Coulomb friction F_c [N or Nm]."""
    viscous: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Viscous coefficient F_v [Ns/m or Nms/rad]."""
    width: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Speed w over which the direction turns [m/s or rad/s]."""

    def __check_init__(self):
        not_negative("coulomb", self.coulomb, "N")
        not_negative("viscous", self.viscous, "Ns/m")
        positive("width", self.width, "m/s")

    def __call__(self, velocity: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        speed = jnp.asarray(velocity)
        return self.coulomb * (2 / jnp.pi) * jnp.arctan(speed / self.width) + self.viscous * speed
