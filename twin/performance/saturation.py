"""How long a limit was reached."""

import warnings

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, above_zero, is_concrete
from twin.performance._piecewise import samples_of

# A smooth limit of the usual width, a thousandth of the limit, is met to half of that.
_NEAR = 1e-3


def limit_share(
    times: Float[ArrayLike, "samples"],
    voltage: Float[ArrayLike, "samples"],
    limit: Float[ArrayLike, ""],
    *,
    tolerance: Float[ArrayLike, ""] = _NEAR,
) -> Float[Array, ""]:
    """Share of the time in which a signal is at its limit, |u| >= (1 - tolerance)·limit.

    Between samples the signal runs straight. Differentiable but where it touches the limit at a sample.

    Args:
        times: times (samples,) [s].
        voltage: limited signal u (samples,) [V, or the unit of another limit].
        limit: largest magnitude that it can have [unit of u]; with infinity the share is zero.
        tolerance: share of the limit within which it counts as reached [-]; the default suits `smooth_clip`.

    Returns:
        Share of the time, 0 to 1; NaN if a sample is NaN.

    Raises:
        InputError: 64-bit mode off, times that do not increase, a signal of another length, a limit that is not above
            zero, a tolerance outside 0 to 1.
    """
    t, (u,) = samples_of(times, voltage=voltage)
    above_zero("limit", limit, "V")
    if is_concrete(tolerance) and not 0 <= float(jnp.asarray(tolerance)) < 1:
        raise InputError(f"tolerance must lie between 0 and 1, but is {tolerance}. It is a share of the limit.")
    level = jnp.asarray((1 - jnp.asarray(tolerance)) * jnp.asarray(limit, dtype=jnp.float64))
    # A limit beyond all samples is as good as an infinite one, and has finite distances.
    level = jnp.where(jnp.isinf(level), 2 * jnp.max(jnp.abs(u)) + 1, level)
    share = _share_above(u - level) + _share_above(-u - level)
    return jnp.sum(jnp.diff(t) * share) / (t[-1] - t[0])


def warn_at_limit(
    times: Float[ArrayLike, "samples"],
    voltage: Float[ArrayLike, "samples"],
    limit: Float[ArrayLike, ""],
    *,
    most: float = 0.95,
    name: str = "voltage",
) -> None:
    """Warn if a signal is at its limit (nearly) all the time: such a run says nothing about the controller.

    Args:
        times: as in `limit_share` [s].
        voltage: as in `limit_share`; known values, not traced.
        limit: as in `limit_share`.
        most: share of the time from which on there is a warning [-].
        name: what is limited, for the message.

    Raises:
        InputError: as `limit_share`.
    """
    share = float(limit_share(times, voltage, limit))
    if share >= most:
        warnings.warn(
            f"{name} limit reached all the time ({100 * share:.3g} % of it, limit {float(jnp.asarray(limit)):g}): the "
            "axis cannot follow its reference. Ask for a slower motion, lower the gains if it oscillates, or raise the "
            "limit.",
            stacklevel=2,
        )


def _share_above(height: Array) -> Array:
    """Share of each straight piece in which the signal is not below zero."""
    begin, end = height[:-1], height[1:]
    first, second = begin >= 0, end >= 0
    crosses = first != second
    part = jnp.where(first, begin, end) / jnp.where(crosses, jnp.abs(begin - end), 1.0)
    known = jnp.where(jnp.isnan(begin) | jnp.isnan(end), jnp.nan, 1.0)
    return known * jnp.where(crosses, part, jnp.where(first & second, 1.0, 0.0))
