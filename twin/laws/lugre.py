"""LuGre friction: elastic bristles that deflect before they slide."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import as_scalar, not_negative, positive
from twin.laws.friction import AbstractFriction
from twin.laws.smooth import smooth_abs, smooth_sign
from twin.laws.stribeck import check_levels, stribeck_level


class LuGreState(NamedTuple):
    """Internal state of LuGre friction."""

    deflection: Float[Array, "*batch"]
    """Mean deflection of the bristles z [m or rad]."""


class LuGreFriction(AbstractFriction):
    """dz/dt = v - σ0·|v|/g(v)·z,  F = σ0·z + σ1·dz/dt + σ2·v,  with g(v) the Stribeck level.

    |v| is smoothed as √(v² + w²). At constant speed z comes to rest at g(v)·v / (σ0·√(v² + w²)), so that the force in
    steady state is exactly the Stribeck curve with the same width, `steady_state`. The price is creep: under a constant
    force F below breakaway the bristles do not hold for ever but give way at the speed at which the Stribeck curve
    equals F, which is of the order of w. Choose w well below the slowest speed that matters.

    Passivity: σ0·z²/2 is stored energy and the law dissipates wherever σ1²·|v| <= 4·(σ1 + σ2)·g(v), that is, at all
    speeds up to about 4·F_c·(σ1 + σ2)/σ1². Above that speed a large σ1 can feed energy into the axis for a moment.

    The bristles settle with the rate σ0·|v|/g(v) [1/s], which is large at high speed: the equations become stiff.

    Raises:
        InputError: if static < coulomb, a coefficient is negative, F_c, v_s, σ0, δ or w is not positive, or any is not
            finite.

    Source: C. Canudas de Wit, H. Olsson, K. J. Åström, P. Lischinsky, "A new model for control of systems with
    friction", IEEE Trans. Automatic Control 40 (1995) 419-425; written with σ0·|v|/g(v) as in K. J. Åström,
    C. Canudas de Wit, "Revisiting the LuGre friction model", IEEE Control Systems Magazine 28 (2008) 101-114.
    """

    coulomb: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Coulomb friction F_c [N or Nm]."""
    static: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Breakaway force F_s, at least F_c [N or Nm]."""
    stribeck_velocity: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Stribeck velocity v_s [m/s or rad/s]."""
    stiffness: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Stiffness of the bristles σ0 [N/m or Nm/rad]."""
    damping: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Damping of the bristles σ1 [Ns/m or Nms/rad]."""
    viscous: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Viscous coefficient σ2 [Ns/m or Nms/rad]."""
    width: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Speed w over which |v| is rounded off; sets the creep at rest [m/s or rad/s]."""
    exponent: Float[Array, ""] = eqx.field(converter=as_scalar, default=2.0)
    """Shape δ of the Stribeck curve [-]."""

    def __check_init__(self):
        positive("coulomb", self.coulomb, "N")
        not_negative("static", self.static, "N")
        check_levels(self.coulomb, self.static)
        positive("stribeck_velocity", self.stribeck_velocity, "m/s")
        positive("stiffness", self.stiffness, "N/m")
        not_negative("damping", self.damping, "Ns/m")
        not_negative("viscous", self.viscous, "Ns/m")
        positive("width", self.width, "m/s")
        positive("exponent", self.exponent)

    def initial_state(self) -> LuGreState:
        return LuGreState(jnp.zeros(()))

    def level(self, velocity: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        """Stribeck level g(v): the force σ0·z at which the bristles slide [N or Nm].

        Args:
            velocity: speed of any shape [m/s or rad/s].
        """
        return stribeck_level(velocity, self.coulomb, self.static, self.stribeck_velocity, self.exponent, self.width)

    def rate(self, state: Any, velocity: Float[ArrayLike, "*batch"]) -> LuGreState:
        settling = self.stiffness * smooth_abs(velocity, self.width) / self.level(velocity)
        return LuGreState(velocity - settling * state.deflection)

    def force(
        self, state: Any, velocity: Float[ArrayLike, "*batch"], position: Float[ArrayLike, "*batch"]
    ) -> Float[Array, "*batch"]:
        sliding = self.rate(state, velocity).deflection
        return self.stiffness * state.deflection + self.damping * sliding + self.viscous * jnp.asarray(velocity)

    def steady_state(self, velocity: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        """Force after a long time at constant speed: the Stribeck curve g(v)·sgn(v) + σ2·v [N or Nm].

        Args:
            velocity: speed of any shape [m/s or rad/s].
        """
        return self.level(velocity) * smooth_sign(velocity, self.width) + self.viscous * jnp.asarray(velocity)
