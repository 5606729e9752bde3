"""Energy that a motor takes up while it drives."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import positive
from twin.laws.smooth import smooth_sign
from twin.performance._piecewise import area_above_zero, area_of, samples_of

# Widths by which the smooth switch lies on the side of dragging: at rest 99.75 % of the power is counted.
_AT_REST = 6.0


def motoring_energy(
    times: Float[ArrayLike, "samples"],
    power: Float[ArrayLike, "samples"],
    *,
    dragged: Float[ArrayLike, "samples"] | None = None,
    width: Float[ArrayLike, ""] | None = None,
) -> Float[Array, ""]:
    """Energy taken up by a motor; the intervals in which it is dragged do not count, as they only heat a resistor.

    Between samples the signals run straight, and the instants at which they change sign are found between the samples.
    By default the motor counts as dragged where it gives power back: the integral of max(P, 0). It still takes power up
    where it is dragged slowly and its copper loss exceeds what comes from the shaft; with `dragged` the shaft decides.

    Differentiable in both modes. Where power and derivative of power are zero together, as at rest, the derivative is
    taken from the left, zero.

    Args:
        times: times (samples,) [s].
        power: electrical power P (samples,), positive when taken up [W].
        dragged: mechanical power of the shaft (samples,), torque times speed [W]. If given, P counts with its sign
            where this is zero or positive, and nothing counts where it is negative.
        width: power over which counting sets in [W], for a derivative without steps: P·(1 + P/√(P² + w²))/2, which is
            zero at P = 0; with `dragged` M it is P/(1 + exp(-M/w - 6)), which counts at rest. None: sharp.

    Returns:
        Energy [J]; NaN if a sample is NaN.

    Raises:
        InputError: 64-bit mode off, times that do not increase, signals of another length, a width that is not
            positive.

    Source: Mauro et al., section 7: "the time intervals in which the motor shaft is dragged by the screw are not
    considered".
    """
    t, (p, *shaft) = samples_of(times, power=power, dragged=dragged)
    step, ends = jnp.diff(t), (p[:-1], p[1:])
    if width is None:
        return _motored(step, *ends, shaft[0]) if shaft else area_above_zero(step, *ends)
    positive("width", width, "W")
    if not shaft:
        return area_of(lambda p: 0.5 * p * (1 + smooth_sign(p, width)), step, ends)
    return area_of(lambda p, m: p * jax.nn.sigmoid(m / width + _AT_REST), step, ends, (shaft[0][:-1], shaft[0][1:]))


def _motored(step: Array, begin: Array, end: Array, shaft: Array) -> Float[Array, ""]:
    """Integral of the power over the parts of the pieces in which the shaft's power is not negative."""
    m_0, m_1 = shaft[:-1], shaft[1:]
    turns = (m_0 < 0) != (m_1 < 0)
    crossing = m_0 / jnp.where(turns, m_0 - m_1, 1.0)
    first = jnp.where(m_0 < 0, jnp.where(turns, crossing, 1.0), 0.0)
    last = jnp.where(m_1 < 0, jnp.where(turns, crossing, 1.0), 1.0)
    counted = begin * (last - first) + 0.5 * (end - begin) * (last**2 - first**2)
    # A comparison with NaN is false, and would count.
    known = jnp.where(jnp.all(jnp.isfinite(shaft)), 1.0, jnp.nan)
    return known * jnp.sum(step * counted)
