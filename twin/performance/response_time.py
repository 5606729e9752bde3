"""When a motion has arrived: response time and settling time, found between the samples."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import positive
from twin.performance._piecewise import direction_of_travel, samples_of

# Halvings that leave nothing of an interval in double precision.
_HALVINGS = 52


def response_time(
    times: Float[ArrayLike, "samples"],
    position: Float[ArrayLike, "samples"],
    target: Float[ArrayLike, ""],
    *,
    start: Float[ArrayLike, ""] | None = None,
    share: Float[ArrayLike, ""] = 0.99,
    settle: bool = False,
    velocity: Float[ArrayLike, "samples"] | None = None,
) -> Float[Array, ""]:
    """Time from the first sample until the position reaches start + share·(target - start).

    The instant lies between two samples, on a straight line or, with the speed, on the cubic through both with their
    slopes. It is differentiable with respect to positions, speeds, start, target and share (implicit function theorem).

    Args:
        times: times (samples,) [s].
        position: position (samples,) [m or rad].
        target: end of the move [m or rad].
        start: where it began [m or rad]; the first position if not given.
        share: share of the travel that has to be covered [-], above 0.
        settle: take the last time that it is reached, after which the position does not fall below it again, instead of
            the first.
        velocity: speed (samples,) [m/s or rad/s], for a cubic between samples.

    Returns:
        Time [s]; zero if the first sample is there already. NaN, as its derivatives are, if it is never reached (with
        `settle`: not at the end), or a sample is NaN.

    Raises:
        InputError: 64-bit mode off, times that do not increase, another length, start and target the same, a share that
            is not positive.

    Source: Mauro et al., section 7: the time to travel from middle stroke to 99 % of its end.
    """
    t, (x, *speed) = samples_of(times, position=position, velocity=velocity)
    positive("share", share)
    end = jnp.asarray(target, dtype=jnp.float64)
    begin = x[0] if start is None else jnp.asarray(start, dtype=jnp.float64)
    direction = direction_of_travel(begin, end)
    above = direction * (x - begin - jnp.asarray(share) * (end - begin))
    return _crossing(t, above, direction * speed[0] if speed else None, last=settle)


def settling_time(
    times: Float[ArrayLike, "samples"],
    position: Float[ArrayLike, "samples"],
    target: Float[ArrayLike, "*samples"],
    tolerance: Float[ArrayLike, ""],
    *,
    velocity: Float[ArrayLike, "samples"] | None = None,
) -> Float[Array, ""]:
    """Time from the first sample until the position stays within a band about its target.

    Args:
        times: times (samples,) [s].
        position: position (samples,) [m or rad].
        target: where it ought to be, one number or (samples,) [m or rad].
        tolerance: half of the width of the band [m or rad].
        velocity: speed (samples,) relative to the target [m/s or rad/s], for a cubic between samples.

    Returns:
        Time [s]; zero if it never leaves the band. NaN, as its derivatives are, if the last sample is outside, or a
        sample is NaN. Differentiable as `response_time`.

    Raises:
        InputError: 64-bit mode off, times that do not increase, another length, a tolerance that is not positive.
    """
    t, (x, wanted, *speed) = samples_of(times, position=position, target=target, velocity=velocity)
    positive("tolerance", tolerance, "m")
    error = x - wanted
    outside = jnp.abs(error) > tolerance
    last = jnp.max(jnp.where(outside, jnp.arange(t.size), 0))
    # On the side on which it is left for the last time, there is no kink.
    side = jnp.sign(error[last])
    inside = jnp.asarray(tolerance) - side * error
    return _crossing(t, inside, -side * speed[0] if speed else None, last=True, index=last, met=~jnp.any(outside))


def _crossing(
    t: Float[Array, "samples"],
    value: Float[Array, "samples"],
    slope: Float[Array, "samples"] | None,
    *,
    last: bool,
    index: Array | None = None,
    met: Array | None = None,
) -> Float[Array, ""]:
    """Time since the first sample at which a value rises through zero; NaN if it does not."""
    below = value < 0
    if last:
        arrived = ~below[-1]
        i = jnp.max(jnp.where(below, jnp.arange(t.size), 0)) if index is None else index
        already = ~jnp.any(below) if met is None else met
    else:
        arrived = ~jnp.all(below)
        i = jnp.argmax(~below) - 1
        already = ~below[0]
    i = jnp.clip(i, 0, t.size - 2)
    known = arrived & jnp.all(jnp.isfinite(value))
    # Nothing guards what is never reached: its derivatives are NaN as it is itself.
    v_0, v_1 = jnp.where(already, -1.0, value[i]), jnp.where(already, 1.0, value[i + 1])
    step = t[i + 1] - t[i]
    share = v_0 / (v_0 - v_1)
    if slope is not None:
        known &= jnp.all(jnp.isfinite(slope))
        rise_0, rise_1 = (jnp.where(already, 2.0, step * slope[k]) for k in (i, i + 1))
        share = _hermite_root(v_0, v_1, rise_0, rise_1)
    # Multiplied and not chosen: a choice would have a derivative of zero.
    return jnp.where(known, 1.0, jnp.nan) * jnp.where(already, 0.0, t[i] + step * share - t[0])


def _hermite_root(v_0: Array, v_1: Array, s_0: Array, s_1: Array) -> Float[Array, ""]:
    """Where the cubic with these ends and slopes on [0, 1] is zero; v_0 < 0 <= v_1."""

    def cubic(s: Array, v_0: Array, v_1: Array, s_0: Array, s_1: Array) -> Array:
        return (1 + 2 * s) * (1 - s) ** 2 * v_0 + s**2 * (3 - 2 * s) * v_1 + s * (1 - s) * ((1 - s) * s_0 - s * s_1)

    fixed = jax.lax.stop_gradient((v_0, v_1, s_0, s_1))

    def halve(_: Any, ends: tuple[Array, Array]) -> tuple[Array, Array]:
        low, high = ends
        middle = 0.5 * (low + high)
        under = cubic(middle, *fixed) < 0
        return jnp.where(under, middle, low), jnp.where(under, high, middle)

    _, root = jax.lax.fori_loop(0, _HALVINGS, halve, (jnp.zeros_like(fixed[0]), jnp.ones_like(fixed[0])))
    rate = jax.grad(cubic)(root, *fixed)
    # One step of Newton's, whose value is nothing and whose derivative is that of the implicit function.
    return root - cubic(root, v_0, v_1, s_0, s_1) / rate
