"""Coulomb and viscous friction that differ between the two directions."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import as_scalar, not_negative, positive
from twin.laws.friction import AbstractStaticFriction
from twin.laws.smooth import smooth_sign


class AsymmetricFriction(AbstractStaticFriction):
    """F = F_c± · sgn(v) + F_v± · v, each direction with its own coefficients.

    The coefficients of the two directions are blended with the weight (1 + sgn(v))/2, the sign smoothed over a width of
    speed. With non-negative coefficients the law never drives.

    Raises:
        InputError: if a coefficient is negative, the width is not positive, or any is not finite.
    """

    coulomb_positive: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Coulomb friction in positive direction F_c+, a magnitude [N or Nm]."""
    coulomb_negative: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Coulomb friction in negative direction F_c-, a magnitude [N or Nm]."""
    viscous_positive: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Viscous coefficient in positive direction F_v+ [Ns/m or Nms/rad]."""
    viscous_negative: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Viscous coefficient in negative direction F_v- [Ns/m or Nms/rad]."""
    width: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Speed w over which one direction turns into the other [m/s or rad/s]."""

    def __check_init__(self):
        not_negative("coulomb_positive", self.coulomb_positive, "N")
        not_negative("coulomb_negative", self.coulomb_negative, "N")
        not_negative("viscous_positive", self.viscous_positive, "Ns/m")
        not_negative("viscous_negative", self.viscous_negative, "Ns/m")
        positive("width", self.width, "m/s")

    def __call__(self, velocity: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        direction = smooth_sign(velocity, self.width)
        forward = 0.5 * (1.0 + direction)
        backward = 0.5 * (1.0 - direction)
        coulomb = forward * self.coulomb_positive + backward * self.coulomb_negative
        viscous = forward * self.viscous_positive + backward * self.viscous_negative
        return coulomb * direction + viscous * jnp.asarray(velocity)
