"""Stribeck friction: a breakaway force that falls to the Coulomb level as speed rises."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, as_scalar, is_concrete, not_negative, positive
from twin.laws.friction import AbstractStaticFriction
from twin.laws.smooth import smooth_power, smooth_sign

# exp(-700) is the last power of e that is no denormal number: beyond, nothing is left of the breakaway force.
_SPENT = 700.0


def stribeck_level(
    velocity: Float[ArrayLike, "*batch"],
    coulomb: Float[ArrayLike, ""],
    static: Float[ArrayLike, ""],
    stribeck_velocity: Float[ArrayLike, ""],
    exponent: Float[ArrayLike, ""],
    width: Float[ArrayLike, ""],
) -> Float[Array, "*batch"]:
    """Magnitude of Stribeck friction without its viscous part: g(v) = F_c + (F_s - F_c)·exp(-|v/v_s|^δ).

    Even and smooth in v, F_s at v = 0 exactly, and falling to F_c.

    Args:
        velocity: speed v of any shape [m/s or rad/s].
        coulomb: Coulomb friction F_c [N or Nm].
        static: breakaway force F_s [N or Nm].
        stribeck_velocity: speed v_s at which the surplus over F_c has fallen to 1/e [m/s or rad/s].
        exponent: shape δ [-].
        width: speed over which |v| is rounded off [m/s or rad/s].

    Returns:
        The level g in the shape of v [N or Nm].

    Source: B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, "A survey of models, analysis tools and compensation
    methods for the control of machines with friction", Automatica 30 (1994) 1083-1138, section 2.
    """
    coulomb, static = jnp.asarray(coulomb), jnp.asarray(static)
    spent = jnp.abs(velocity) > stribeck_velocity * _SPENT ** (1.0 / jnp.asarray(exponent))
    guarded = jnp.where(spent, stribeck_velocity, velocity)
    decay = jnp.exp(-smooth_power(guarded / stribeck_velocity, width / stribeck_velocity, exponent))
    return coulomb + (static - coulomb) * jnp.where(spent, 0.0, decay)


def check_levels(coulomb: Float[ArrayLike, ""], static: Float[ArrayLike, ""]) -> None:
    """Raise unless the breakaway force is at least the Coulomb friction. Traced values pass.

    Raises:
        InputError: if it is lower.
    """
    if not all(isinstance(level, jax.Array) and is_concrete(level) for level in (coulomb, static)):
        return
    if np.any(np.asarray(static) < np.asarray(coulomb)):
        raise InputError(
            f"static, the breakaway force, must be at least the Coulomb friction ({np.asarray(coulomb)} N), but is "
            f"{np.asarray(static)} N. Swap the two if they were given in the wrong order."
        )


class StribeckFriction(AbstractStaticFriction):
    """F = [F_c + (F_s - F_c)·exp(-|v/v_s|^δ)]·sgn(v) + F_v·v, smooth at zero speed for any δ > 0.

    Because the sign is smoothed, the largest force at slow motion stays below F_s, for δ = 2 by about the share
    √(2·(1 - F_c/F_s))·w/v_s: choose w well below v_s.

    Raises:
        InputError: if static < coulomb, a level or coefficient is negative, v_s, δ or w is not positive, or any is not
            finite.

    Source: as `stribeck_level`.
    """

    coulomb: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Coulomb friction F_c [N or Nm]."""
    static: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Breakaway force F_s, at least F_c [N or Nm]."""
    stribeck_velocity: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Stribeck velocity v_s [m/s or rad/s]."""
    viscous: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Viscous coefficient F_v [Ns/m or Nms/rad]."""
    width: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Speed w over which the direction turns; to be well below v_s [m/s or rad/s]."""
    exponent: Float[Array, ""] = eqx.field(converter=as_scalar, default=2.0)
    """Shape δ of the fall [-]: 2 is Gaussian, 1 exponential (Tustin)."""

    def __check_init__(self):
        not_negative("coulomb", self.coulomb, "N")
        not_negative("static", self.static, "N")
        check_levels(self.coulomb, self.static)
        positive("stribeck_velocity", self.stribeck_velocity, "m/s")
        not_negative("viscous", self.viscous, "Ns/m")
        positive("width", self.width, "m/s")
        positive("exponent", self.exponent)

    def __call__(self, velocity: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        level = stribeck_level(velocity, self.coulomb, self.static, self.stribeck_velocity, self.exponent, self.width)
        return level * smooth_sign(velocity, self.width) + self.viscous * jnp.asarray(velocity)
