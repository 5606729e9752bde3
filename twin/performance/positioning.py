"""Error, energy and time of one positioning, and what they cost together."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, finite, positive, require_x64
from twin.laws.smooth import smooth_abs
from twin.performance.energy import motoring_energy
from twin.performance.response_time import response_time
from twin.performance.static_error import static_error
from twin.trajectory import Trajectory


class PositioningPerformance(NamedTuple):
    """What Mauro et al. judge a positioning by, section 7 and fig. 11."""

    error: Float[Array, ""]
    """Static position error err, target minus position [m]."""
    energy: Float[Array, ""]
    """Energy taken up while motoring, ener [J]."""
    time: Float[Array, ""]
    """Response time τ [s]."""


def positioning_performance(
    trajectory: Trajectory,
    target: Float[ArrayLike, ""],
    *,
    window: Float[ArrayLike, ""],
    start: Float[ArrayLike, ""] | None = None,
    share: Float[ArrayLike, ""] = 0.99,
    width: Float[ArrayLike, ""] | None = None,
    position: str = "position",
    velocity: str | None = None,
    power: str = "power",
) -> PositioningPerformance:
    """Static error, motoring energy and response time of a simulated move from where it starts to a target.

    Args:
        trajectory: a simulation.
        target: end of the move [m or rad].
        window: time at the end over which the static error is averaged [s].
        start: where the move began [m or rad]; the first position if not given.
        share: share of the travel that ends the response time [-].
        width: power over which counting sets in, as in `motoring_energy` [W].
        position: name of the output that is positioned.
        velocity: name of the output that is its speed, for a response time on a cubic between samples; on a straight
            line if not given.
        power: name of the output that is the electrical power.

    Returns:
        The three measures; NaN where the simulation failed, or the share is never reached.

    Raises:
        InputError: an output that the simulated system does not have, and as `static_error` and `response_time`.
    """
    t, x = trajectory.times, trajectory.channel(position)
    return PositioningPerformance(
        static_error(t, x, target, window).signed,
        motoring_energy(t, trajectory.channel(power), width=width),
        response_time(
            t, x, target, start=start, share=share, velocity=None if velocity is None else trajectory.channel(velocity)
        ),
    )


def positioning_cost(
    error: Float[ArrayLike, "*designs"],
    energy: Float[ArrayLike, "*designs"],
    time: Float[ArrayLike, "*designs"],
    *,
    worst_error: Float[ArrayLike, ""] | None = None,
    least_energy: Float[ArrayLike, ""] | None = None,
    least_time: Float[ArrayLike, ""] | None = None,
    width: Float[ArrayLike, ""] | None = None,
) -> Float[Array, "*designs"]:
    """Cost of positionings, C = |err|/err_max - ener_min/ener - τ_min/τ, between -2 and 1 within a sweep.

    The references err_max, ener_min and τ_min are the largest and smallest of the designs given, unless given
    themselves: a single design is then scored on the scale of an earlier sweep, and the cost has a derivative that does
    not jump from one design's to another's.

    Args:
        error: static position errors err of the designs, of either sign [m or rad].
        energy: energies ener, positive [J].
        time: response times τ, positive [s].
        worst_error: err_max [m or rad].
        least_energy: ener_min [J].
        least_time: τ_min [s].
        width: error over which |err| is rounded off, √(err² + w²), in the unit of the error: near the best design
            the error passes through zero, where |err| has a kink. None: sharp.

    Returns:
        Cost of each design [-]. A design of which a measure is NaN costs NaN, and does not count for the references.

    Raises:
        InputError: 64-bit mode off, shapes that differ, a reference or width that is not positive.

    Source: Mauro et al., eq. 22.
    """
    require_x64()
    err, ener, tau = (jnp.asarray(values, dtype=jnp.float64) for values in (error, energy, time))
    if not err.shape == ener.shape == tau.shape:
        raise InputError(
            f"error, energy and time have shapes {err.shape}, {ener.shape} and {tau.shape}. Give one each per design."
        )
    for name, reference, unit in (
        ("worst_error", worst_error, "m"),
        ("least_energy", least_energy, "J"),
        ("least_time", least_time, "s"),
    ):
        if reference is not None:
            finite(name, reference, unit)
            positive(name, reference, unit)
    if width is not None:
        positive("width", width, "m")
    size = jnp.abs(err) if width is None else smooth_abs(err, width)
    known = jnp.isfinite(err) & jnp.isfinite(ener) & jnp.isfinite(tau)
    largest = jnp.max(jnp.where(known, size, -jnp.inf)) if worst_error is None else jnp.asarray(worst_error)
    least = jnp.min(jnp.where(known, ener, jnp.inf)) if least_energy is None else jnp.asarray(least_energy)
    soonest = jnp.min(jnp.where(known, tau, jnp.inf)) if least_time is None else jnp.asarray(least_time)
    cost = size / largest - least / ener - soonest / tau  # eq. 22
    return jnp.where(known, 1.0, jnp.nan) * cost
