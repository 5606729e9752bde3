"""How far a loop is from instability, read from the frequency response of its open loop."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Complex, Float

from twin._checks import InputError, increasing, positive, require_x64
from twin.frf import FRF
from twin.linear import StateSpace

# A response below this is none; far above the smallest double, so that its logarithm has a derivative.
_NOTHING = 1e-150


class StabilityMargin(NamedTuple):
    """Distance of an open loop G from the point -1."""

    sensitivity_peak: Float[Array, ""]
    """M_s, the largest |1/(1 + G)| [-]: 1/M_s is the distance from -1. Up to 2 is usual."""
    gain_margin: Float[Array, ""]
    """Factor on the gain at which G passes through -1 [-]; of several the nearest to 1. Below 1 the gain would have to
    fall. Infinite where the phase does not cross -180° within the frequencies."""
    phase_margin: Float[Array, ""]
    """Lag at which G passes through -1 [rad]; of several the nearest to zero. Infinite where |G| does not cross 1."""
    phase_crossover: Float[Array, ""]
    """Frequency of the gain margin [Hz]; NaN where there is none."""
    gain_crossover: Float[Array, ""]
    """Frequency of the phase margin, the bandwidth of the open loop [Hz]; NaN where there is none."""


def stability_margin(
    open_loop: FRF | StateSpace | Complex[Array, "frequencies"],
    frequency: Float[ArrayLike, "frequencies"] | None = None,
    *,
    output: str | None = None,
    excitation: str | None = None,
    width: Float[ArrayLike, ""] | None = None,
) -> StabilityMargin:
    """Sensitivity peak, gain and phase margin of an open loop with negative feedback around it, 1/(1 + G).

    Between two frequencies the locus turns and grows evenly, in angle and in ln|G|; the sensitivity is that at the
    frequencies. The grid has to be fine where the locus comes near -1. Whether the closed loop is stable at all is not
    judged; for a stable open loop with one crossing each, a gain margin above 1 says so. Differentiable; among several
    frequencies or crossings the derivative is that of the one that decides.

    Args:
        open_loop: response G of the opened loop, a linear system, or its values (frequencies,).
        frequency: frequencies [Hz]; needed unless the response has its own.
        output: which output of a response or system with several.
        excitation: which input of a response or system with several.
        width: M_s is smoothed over this [-], w·ln Σexp(|S|/w) over the frequencies: a derivative without jumps, never
            below the sharp peak and at most w·ln(frequencies) above. None: sharp.

    Returns:
        The margins; NaN throughout if the response is not finite.

    Raises:
        InputError: 64-bit mode off, frequencies missing, given twice, not increasing or of another length, several
            responses and none named, an unknown name, a width that is not positive.
    """
    require_x64()
    f, g = _locus(open_loop, frequency, output, excitation)
    sensitivity = 1 / jnp.abs(1 + g)
    peak = jnp.max(sensitivity)
    if width is not None:
        positive("width", width)
        peak = width * jax.nn.logsumexp(sensitivity / width)
    known = jnp.where(jnp.all(jnp.isfinite(g)), 1.0, jnp.nan)
    gain, at_phase = _gain_margin(f, g)
    phase, at_gain = _phase_margin(f, g)
    return StabilityMargin(*(known * value for value in (peak, gain, phase, at_phase, at_gain)))


def _gain_margin(f: Array, g: Array) -> tuple[Array, Array]:
    angle, level = jnp.angle(-g), _level(g)
    below, above = angle[:-1], angle[1:]
    # Where the angle from -1 jumps by half a turn and more, it is the positive axis that is crossed.
    crosses = ((below < 0) != (above < 0)) & (jnp.abs(above - below) < jnp.pi)
    share = below / jnp.where(crosses, below - above, 1.0)
    logarithm = -(level[:-1] + share * jnp.diff(level))
    i = jnp.argmin(jnp.where(crosses, jnp.abs(logarithm), jnp.inf))
    found = jnp.any(crosses)
    return jnp.where(found, jnp.exp(logarithm[i]), jnp.inf), jnp.where(
        found, f[i] + share[i] * (f[i + 1] - f[i]), jnp.nan
    )


def _phase_margin(f: Array, g: Array) -> tuple[Array, Array]:
    level = _level(g)
    crosses = (level[:-1] < 0) != (level[1:] < 0)
    share = level[:-1] / jnp.where(crosses, level[:-1] - level[1:], 1.0)
    # Turned back by what G turns within the interval, so that the branch of the angle does not matter.
    margin = jnp.angle(-g[:-1]) + share * jnp.angle(g[1:] * jnp.conj(g[:-1]))
    margin = margin - 2 * jnp.pi * jnp.round(jax.lax.stop_gradient(margin) / (2 * jnp.pi))
    i = jnp.argmin(jnp.where(crosses, jnp.abs(margin), jnp.inf))
    found = jnp.any(crosses)
    return jnp.where(found, margin[i], jnp.inf), jnp.where(found, f[i] + share[i] * (f[i + 1] - f[i]), jnp.nan)


def _level(g: Array) -> Array:
    """ln|G|, bounded where G is zero."""
    return jnp.log(jnp.maximum(jnp.abs(g), _NOTHING))


def _locus(open_loop: object, frequency: ArrayLike | None, output: str | None, excitation: str | None) -> tuple:
    if isinstance(open_loop, FRF):
        if frequency is not None:
            raise InputError("An FRF has its own frequencies; leave frequency out, or use FRF.between for a range.")
        return open_loop.frequency, open_loop[
            _only("output", open_loop.outputs, output), _only("input", open_loop.inputs, excitation)
        ]
    if frequency is None:
        raise InputError(f"A {type(open_loop).__name__} needs the frequencies at which it is looked at [Hz].")
    f = jnp.asarray(frequency, dtype=jnp.float64)
    increasing("frequency", f, "Hz")
    if isinstance(open_loop, StateSpace):
        row = open_loop.outputs.index(_only("output", open_loop.outputs, output))
        column = open_loop.inputs.index(_only("input", open_loop.inputs, excitation))
        return f, open_loop.response(f)[row, column]
    g = jnp.asarray(open_loop)
    if g.shape != f.shape or f.ndim != 1 or f.size < 2:
        raise InputError(
            f"open_loop has shape {g.shape} and frequency {f.shape}. Give one value per frequency, at least two."
        )
    return f, g


def _only(kind: str, names: tuple[str, ...], wanted: str | None) -> str:
    if wanted is None and len(names) == 1:
        return names[0]
    if wanted not in names:
        raise InputError(f"Name one {kind} of the open loop: it has {', '.join(names)}, and {wanted!r} was given.")
    return wanted
