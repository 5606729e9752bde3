"""Dahl friction: the sliding force builds up over a small displacement after each reversal."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, as_scalar, finite, is_concrete, not_negative, positive
from twin.laws.friction import AbstractFriction
from twin.laws.position_force import AbstractPositionForce, NoForce
from twin.laws.smooth import smooth_abs


class DahlState(NamedTuple):
    """Internal state of Dahl friction."""

    direction: Float[Array, "*batch"]
    """How far the contact has turned into the direction of motion z [-], from -1 to 1."""


class DahlFriction(AbstractFriction):
    """F = z·(F_c + F_1·(1 - exp(-|v|/v_1)) + F_v·|v| + ΔF(x)) + z²·F_a·|v| + σ_1·δ·dz/dt,  dz/dt = (u - |u|·z)/δ.

    z follows the direction of motion over the displacement δ: balls of a screw or guide roll a few micrometres before
    they slide. It takes the place of sgn(v), so that friction has hysteresis instead of a jump. The sliding level
    starts at F_c and rises by F_1 over the speed v_1, as lubricant is drawn in and sheared; the viscous coefficient is
    F_v + F_a in positive and F_v - F_a in negative direction. ΔF(x) is a change of the sliding level along the travel.
    The contact's damping σ_1 acts while z turns, as the micro-damping of LuGre friction does; without it an axis that
    is held by friction rings for long.

    u = v/√(1 + (v/ρδ)²) is the speed, limited to ρ·δ: above it z has long arrived, and the limit keeps z from moving
    faster than the rate ρ, so that neither fast motion nor a small δ makes the equations stiff.

    Raises:
        InputError: if a force level is negative, a speed or displacement is not positive, the initial direction is
            outside [-1, 1], or any is not finite.

    Source: P. R. Dahl, "A solid friction model", Aerospace Corporation TOR-0158(3107-18)-1, 1968 (exponent 1).
    """

    coulomb: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Sliding level at creeping speed F_c [N or Nm]."""
    viscous: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Viscous coefficient, the mean of both directions F_v [Ns/m or Nms/rad]."""
    displacement: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Displacement over which the force turns around δ [m or rad]."""
    asymmetry: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Half the difference of the viscous coefficients of the two directions F_a [Ns/m or Nms/rad]."""
    rise: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Rise of the sliding level with speed F_1 [N or Nm]; negative for a Stribeck fall."""
    rise_velocity: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.01)
    """Speed of that rise v_1 [m/s or rad/s]."""
    rate_limit: Float[Array, ""] = eqx.field(converter=as_scalar, default=3000.0)
    """Largest rate of z, ρ [1/s]; about twice what sampling and integration steps can resolve."""
    width: Float[Array, ""] = eqx.field(converter=as_scalar, default=1e-5)
    """Speed over which |v| is rounded off [m/s or rad/s]; sets the creep under load at rest."""
    damping: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Damping of the contact while it turns σ_1 [Ns/m or Nms/rad]."""
    variation: AbstractPositionForce = eqx.field(default_factory=NoForce)
    """Change of the sliding level along the travel ΔF(x) [N or Nm], against motion in either direction."""
    initial_direction: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """z at the start: 0 after a rest without load, ±1 in mid-motion [-]."""

    def __check_init__(self):
        not_negative("coulomb", self.coulomb, "N")
        not_negative("viscous", self.viscous, "Ns/m")
        finite("asymmetry", self.asymmetry, "Ns/m")
        positive("displacement", self.displacement, "m")
        finite("rise", self.rise, "N")
        positive("rise_velocity", self.rise_velocity, "m/s")
        positive("rate_limit", self.rate_limit, "1/s")
        positive("width", self.width, "m/s")
        not_negative("damping", self.damping, "Ns/m")
        finite("initial_direction", self.initial_direction)
        start = self.initial_direction
        if is_concrete(start) and isinstance(start, jax.Array) and abs(float(start)) > 1:
            raise InputError(f"initial_direction must lie between -1 and 1, but is {float(start):g}.")

    def initial_state(self) -> DahlState:
        return DahlState(self.initial_direction)

    def rate(self, state: Any, velocity: Float[ArrayLike, "*batch"]) -> DahlState:
        limited = jnp.asarray(velocity) / jnp.sqrt(1 + (velocity / (self.rate_limit * self.displacement)) ** 2)
        return DahlState((limited - smooth_abs(limited, self.width) * state.direction) / self.displacement)

    def force(
        self, state: Any, velocity: Float[ArrayLike, "*batch"], position: Float[ArrayLike, "*batch"]
    ) -> Float[Array, "*batch"]:
        z = state.direction
        speed = smooth_abs(velocity, self.width)
        turning = self.damping * self.displacement * self.rate(state, velocity).direction
        return z * (self.level(speed) + self.variation(position)) + z**2 * self.asymmetry * speed + turning

    def level(self, speed: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        """Sliding level, the mean of both directions, where nothing varies along the travel [N or Nm].

        Args:
            speed: magnitude of the speed, any shape [m/s or rad/s].
        """
        return (
            self.coulomb
            - self.rise * jnp.expm1(-jnp.asarray(speed) / self.rise_velocity)
            + self.viscous * jnp.asarray(speed)
        )
