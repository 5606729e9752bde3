"""Coulomb friction, alone and with viscous friction."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import as_scalar, not_negative, positive
from twin.laws.friction import AbstractStaticFriction
from twin.laws.smooth import smooth_sign


class CoulombFriction(AbstractStaticFriction):
    """F = F_c · sgn(v), with the sign smoothed over a width of speed.

    Raises:
        InputError: if the level is negative, the width is not positive, or either is not finite.
    """

    coulomb: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Coulomb friction F_c [N or Nm]."""
    width: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Speed w over which the direction turns; at v = w the force is F_c/√2 [m/s or rad/s]."""

    def __check_init__(self):
        not_negative("coulomb", self.coulomb, "N")
        positive("width", self.width, "m/s")

    def __call__(self, velocity: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        return self.coulomb * smooth_sign(velocity, self.width)


class CoulombViscousFriction(AbstractStaticFriction):
    """F = F_c · sgn(v) + F_v · v, with the sign smoothed over a width of speed.

    Raises:
        InputError: if the level or the coefficient is negative, the width is not positive, or any is not finite.
    """

    coulomb: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Coulomb friction F_c [N or Nm]."""
    viscous: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Viscous coefficient F_v [Ns/m or Nms/rad]."""
    width: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Speed w over which the direction turns; at v = w the Coulomb part is F_c/√2 [m/s or rad/s]."""

    def __check_init__(self):
        not_negative("coulomb", self.coulomb, "N")
        not_negative("viscous", self.viscous, "Ns/m")
        positive("width", self.width, "m/s")

    def __call__(self, velocity: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        return self.coulomb * smooth_sign(velocity, self.width) + self.viscous * jnp.asarray(velocity)
