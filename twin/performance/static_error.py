"""What is left of a positioning error once the axis stands."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, is_concrete, positive
from twin.laws.smooth import smooth_abs
from twin.performance._piecewise import area_above_zero, area_of, samples_of


class StaticError(NamedTuple):
    """Mean error over the last part of a motion."""

    signed: Float[Array, ""]
    """Mean of target minus position: positive where the axis stays behind a target ahead [m]."""
    absolute: Float[Array, ""]
    """Mean of |target minus position|; larger than |signed| where the axis hunts about its target [m]."""


def static_error(
    times: Float[ArrayLike, "samples"],
    position: Float[ArrayLike, "samples"],
    target: Float[ArrayLike, "*samples"],
    window: Float[ArrayLike, ""],
    *,
    width: Float[ArrayLike, ""] | None = None,
) -> StaticError:
    """Static position error: the mean over the last time window, of the error that runs straight between samples.

    Args:
        times: times (samples,) [s].
        position: position (samples,) [m or rad].
        target: where it ought to be, one number or (samples,) [m or rad].
        window: length of the window at the end [s]; it may begin between two samples.
        width: error over which its magnitude is rounded off [m or rad], √(e² + w²); None: sharp, with a kink at zero.

    Returns:
        Mean error with its sign and of its magnitude, in the unit of the position; NaN if a sample is NaN, or if a
        traced window is longer than the motion.

    Raises:
        InputError: 64-bit mode off, times that do not increase, another length, a window or width that is not positive,
            a window longer than the motion.
    """
    t, (x, wanted) = samples_of(times, position=position, target=target)
    positive("window", window, "s")
    begin = t[-1] - window
    if is_concrete(begin) and is_concrete(t) and begin < t[0] - 1e-9 * (t[-1] - t[0]):
        raise InputError(
            f"window is {float(jnp.asarray(window)):g} s, but the motion lasts {float(t[-1] - t[0]):g} s. Shorten it, "
            "or simulate longer."
        )
    error = wanted - x
    at = jnp.clip(begin, t[:-1], t[1:])
    step = t[1:] - at
    first = error[:-1] + (at - t[:-1]) / jnp.diff(t) * jnp.diff(error)
    last = error[1:]
    length = jnp.where(begin < t[0] - 1e-9 * (t[-1] - t[0]), jnp.nan, jnp.sum(step))
    signed = jnp.sum(0.5 * step * (first + last))
    if width is None:
        magnitude = area_above_zero(step, first, last) + area_above_zero(step, -first, -last)
    else:
        positive("width", width, "m")
        magnitude = area_of(lambda e: smooth_abs(e, width), step, (first, last))
    return StaticError(signed / length, magnitude / length)
