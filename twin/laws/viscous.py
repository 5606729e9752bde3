"""Viscous friction."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import as_scalar, not_negative
from twin.laws.friction import AbstractStaticFriction


class ViscousFriction(AbstractStaticFriction):
    """F = F_v · v.

    Raises:
        InputError: if the coefficient is negative or not finite.
    """

    viscous: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Viscous coefficient F_v [Ns/m or Nms/rad]."""

    def __check_init__(self):
        not_negative("viscous", self.viscous, "Ns/m")

    def __call__(self, velocity: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        return self.viscous * jnp.asarray(velocity)
