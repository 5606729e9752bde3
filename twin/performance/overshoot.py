"""How far a motion runs beyond its target."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import positive
from twin.performance._piecewise import direction_of_travel, samples_of


def overshoot(
    times: Float[ArrayLike, "samples"],
    position: Float[ArrayLike, "samples"],
    target: Float[ArrayLike, ""],
    *,
    start: Float[ArrayLike, ""] | None = None,
    width: Float[ArrayLike, ""] | None = None,
) -> Float[Array, ""]:
    """Largest position beyond the target as a share of the travel, max(x - x_t)/(x_t - x_0); zero if there is none.

    The peak is that of the parabola through the highest sample and its neighbours.

    Args:
        times: times (samples,) [s].
        position: position (samples,) [m or rad].
        target: end of the move x_t [m or rad].
        start: where it began x_0 [m or rad]; the first position if not given.
        width: share of the travel over which the maximum is smoothed [-]: w·ln(1 + Σexp(y/w)) over the samples, never
            below the sharp maximum of the samples and at most w·ln(samples + 1) above. None: sharp.

    Returns:
        Overshoot as a share of the travel [-]; NaN if a sample is NaN.

    Raises:
        InputError: 64-bit mode off, times that do not increase, another length, start and target the same, a width
            that is not positive.
    """
    t, (x,) = samples_of(times, position=position)
    end = jnp.asarray(target, dtype=jnp.float64)
    begin = x[0] if start is None else jnp.asarray(start, dtype=jnp.float64)
    direction_of_travel(begin, end)
    beyond = (x - end) / (end - begin)
    if width is not None:
        positive("width", width)
        return jnp.asarray(width) * jax.nn.logsumexp(jnp.append(beyond, 0.0) / width)
    peak = jnp.max(beyond) if t.size < 3 else _peak(t, beyond)
    return jnp.where(peak > 0, peak, jnp.where(jnp.isnan(peak), jnp.nan, 0.0))


def _peak(t: Float[Array, "samples"], y: Float[Array, "samples"]) -> Float[Array, ""]:
    """Height of the parabola through the highest sample and its neighbours, where these enclose it."""
    i = jnp.clip(jnp.argmax(y), 1, t.size - 2)
    before, after = t[i] - t[i - 1], t[i + 1] - t[i]
    rise, fall = (y[i] - y[i - 1]) / before, (y[i + 1] - y[i]) / after
    bend = (fall - rise) / (before + after)
    slope = (rise * after + fall * before) / (before + after)
    enclosed = (y[i] >= y[i - 1]) & (y[i] >= y[i + 1]) & (bend < 0)
    parabola = y[i] - slope**2 / (4 * jnp.where(enclosed, bend, 1.0))
    return jnp.where(enclosed, parabola, jnp.max(y))
