"""The time-optimal point-to-point move under limits of velocity, acceleration and jerk."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import as_scalar, finite, positive
from twin.references.reference import AbstractReference, MotionPoint


class _Phases(NamedTuple):
    """Durations [s] of the phases of a symmetric move: jerk, constant acceleration, jerk, cruise, and the same back."""

    jerk: Float[Array, ""]
    acceleration: Float[Array, ""]
    cruise: Float[Array, ""]

    def ramp(self) -> Float[Array, ""]:
        """Time to get from rest to the peak velocity [s]."""
        return 2 * self.jerk + self.acceleration

    def total(self) -> Float[Array, ""]:
        """Time from rest to rest [s]."""
        return 2 * self.ramp() + self.cruise


class JerkLimitedMove(AbstractReference):
    """The fastest move from rest to rest over a distance, with limited velocity, acceleration and jerk (S-curve).

    Seven phases, of which those vanish that a short move does not reach. Before the move the axis stands at its start,
    after it exactly at start + distance. Position, velocity and acceleration are continuous; they are differentiable in
    closed form with respect to time, distance, limits, start time and start position. Where one case passes into
    another (say, at the distance where the velocity limit is just reached) derivatives of the durations are those of
    one side. A distance of zero is a move that takes no time, with the derivative of a move that has been finished.

    Under a transformation that hides their values, limits that are not positive give NaN.

    Raises:
        InputError: if a limit is not positive, or any value is not finite.

    Source: the rest-to-rest case of the double-S trajectory, L. Biagiotti, C. Melchiorri, "Trajectory Planning for
    Automatic Machines and Robots", Springer 2008, section 3.4.
    """

    distance: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Distance D of the move, of either sign [m or rad]."""
    velocity_limit: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Largest speed V [m/s or rad/s]."""
    acceleration_limit: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Largest acceleration A [m/s² or rad/s²]."""
    jerk_limit: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Largest jerk J [m/s³ or rad/s³]."""
    start_time: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Time at which the move begins [s]."""
    start_position: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Position before the move [m or rad]."""

    def __check_init__(self):
        finite("distance", self.distance, "m")
        positive("velocity_limit", self.velocity_limit, "m/s")
        positive("acceleration_limit", self.acceleration_limit, "m/s²")
        positive("jerk_limit", self.jerk_limit, "m/s³")
        finite("start_time", self.start_time, "s")
        finite("start_position", self.start_position, "m")

    def __call__(self, t: Float[ArrayLike, ""]) -> MotionPoint:
        elapsed = t - self.start_time
        phases = self._phases()
        total = phases.total()
        # The second half is the first one run backwards from the end, which makes the end exact.
        braking = elapsed > total / 2
        since_start = jnp.where(elapsed < 0, 0.0, elapsed)
        until_end = jnp.where(elapsed > total, 0.0, total - elapsed)
        travel, speed, acceleration = self._from_rest(jnp.where(braking, until_end, since_start), phases)
        travelled = jnp.where(braking, jnp.abs(self.distance) - travel, travel)
        direction = self._direction()
        return MotionPoint(
            self.start_position + direction * travelled,
            direction * speed,
            direction * jnp.where(braking, -acceleration, acceleration),
        )

    def jerk(self, t: Float[ArrayLike, ""]) -> Float[Array, ""]:
        """Jerk at a time [m/s³ or rad/s³]: piecewise constant, at a switching time that of the phase which begins."""
        phase = jnp.sum((t >= self.switching_times()).astype(int))
        signs = jnp.array([0.0, 1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0, 0.0])
        _, _, jerk_limit = self._limits()
        return self._direction() * jerk_limit * signs[phase]

    def duration(self) -> Float[Array, ""]:
        """Time from rest to rest T [s]."""
        return self._phases().total()

    def switching_times(self) -> Float[Array, "8"]:
        """The times at which the jerk jumps, from start to end of the move; equal where a phase vanishes [s]."""
        jerk, acceleration, cruise = self._phases()
        lengths = jnp.stack([jerk, acceleration, jerk, cruise, jerk, acceleration, jerk])
        return self.start_time + jnp.concatenate([jnp.zeros(1), jnp.cumsum(lengths)])

    def _direction(self) -> Float[Array, ""]:
        return jnp.where(self.distance < 0, -1.0, 1.0)

    def _limits(self) -> tuple[Array, Array, Array]:
        usable = (self.velocity_limit > 0) & (self.acceleration_limit > 0) & (self.jerk_limit > 0)
        return (
            jnp.where(usable, self.velocity_limit, jnp.nan),
            jnp.where(usable, self.acceleration_limit, jnp.nan),
            jnp.where(usable, self.jerk_limit, jnp.nan),
        )

    def _phases(self) -> _Phases:
        velocity, acceleration, jerk = self._limits()
        distance = jnp.abs(self.distance)
        build_up = acceleration / jerk

        # A ramp to full speed, with or without a stretch at full acceleration.
        full = velocity / acceleration >= build_up
        fast_jerk = jnp.where(full, build_up, jnp.sqrt(velocity / jerk))
        fast_acceleration = jnp.where(full, velocity / acceleration - build_up, 0.0)
        cruise_distance = distance - velocity * (2 * fast_jerk + fast_acceleration)
        fast = cruise_distance >= 0

        # Too short for full speed. At full acceleration the stretch T_a solves A·(T_a + A/J)·(T_a + 2A/J) = D, written
        # so that nothing cancels where it vanishes.
        surplus = distance / acceleration - 2 * build_up**2
        medium = surplus >= 0
        root = jnp.sqrt(build_up**2 + 4 * jnp.where(medium, distance, 0.0) / acceleration)
        medium_acceleration = 2 * surplus / (3 * build_up + root)
        # Too short for full acceleration: 2·J·T_j³ = D. The slope of the cube root at zero is infinite, but a move of
        # no length has no time in which it could matter.
        moving = distance > 0
        short_jerk = jnp.where(moving, jnp.cbrt(jnp.where(moving, distance, 1.0) / (2 * jerk)), 0.0)

        return _Phases(
            jerk=jnp.where(fast, fast_jerk, jnp.where(medium, build_up, short_jerk)),
            acceleration=jnp.where(fast, fast_acceleration, jnp.where(medium, medium_acceleration, 0.0)),
            cruise=jnp.where(fast, cruise_distance / velocity, 0.0),
        )

    def _from_rest(self, elapsed: Float[Array, ""], phases: _Phases) -> tuple[Array, Array, Array]:
        """Distance, speed and acceleration since the start, up to the end of the cruise."""
        _, _, jerk = self._limits()
        ramp = phases.ramp()
        peak_acceleration = jerk * phases.jerk
        peak_speed = peak_acceleration * (phases.jerk + phases.acceleration)
        # Time at full acceleration, speed and distance with which it begins.
        at_full = elapsed - phases.jerk
        speed_then = peak_acceleration * phases.jerk / 2
        distance_then = speed_then * phases.jerk / 3
        # Time until the peak speed is reached, none of it left during the cruise.
        to_peak = ramp - elapsed
        remaining = jnp.where(to_peak < 0, 0.0, to_peak)

        rising = elapsed < phases.jerk
        steady = elapsed < phases.jerk + phases.acceleration
        travel = jnp.where(
            rising,
            jerk * elapsed**3 / 6,
            jnp.where(
                steady,
                distance_then + speed_then * at_full + peak_acceleration * at_full**2 / 2,
                peak_speed * (ramp / 2 - to_peak) + jerk * remaining**3 / 6,
            ),
        )
        speed = jnp.where(
            rising,
            jerk * elapsed**2 / 2,
            jnp.where(steady, speed_then + peak_acceleration * at_full, peak_speed - jerk * remaining**2 / 2),
        )
        acceleration = jnp.where(rising, jerk * elapsed, jnp.where(steady, peak_acceleration, jerk * remaining))
        return travel, speed, acceleration
