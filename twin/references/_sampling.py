"""Looking up and differentiating sampled records."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from twin._checks import InputError, increasing, is_concrete, positive

# A guess by division is put right by one sample at most; a sample may therefore lie this part of a period off the grid.
_JITTER = 0.25


def check_times(times: Float[Array, " samples"]) -> None:
    """Raise unless the times are a strictly increasing vector of at least two.

    Raises:
        InputError: if they are not.
    """
    if times.ndim != 1 or times.size < 2:
        raise InputError(
            f"times must be a vector of at least two sample times, but has the shape {times.shape}. Give a record."
        )
    increasing("times", times, "s")


def is_uniform(times: Float[Array, " samples"]) -> bool:
    """Whether times lie on an even grid, up to jitter, so that a sample's index can be computed instead of searched."""
    if not is_concrete(times):
        return False
    stamps = np.asarray(times)
    grid, period = np.linspace(stamps[0], stamps[-1], stamps.size, retstep=True)
    return bool(np.max(np.abs(stamps - grid)) <= _JITTER * period)


def interval_of(times: Float[Array, " samples"], t: Float[Array, ""], uniform: bool) -> Array:
    """Index i of the interval with times[i] <= t < times[i+1]; the first or the last one for times outside.

    Args:
        times: increasing sample times [s].
        t: time [s].
        uniform: whether `is_uniform` holds.
    """
    last = times.size - 2
    if not uniform:
        return jnp.clip(jnp.searchsorted(times, t, side="right") - 1, 0, last)
    period = (times[-1] - times[0]) / (times.size - 1)
    guess = jnp.clip(jnp.floor((t - times[0]) / period), 0, last).astype(int)
    # Rounding or jitter may put the guess one sample off.
    late = (t >= times[guess + 1]).astype(guess.dtype)
    early = (t < times[guess]).astype(guess.dtype)
    return jnp.clip(guess + late - early, 0, last)


def part_of_interval(times: Float[Array, " samples"], t: Float[Array, ""], index: Array) -> Float[Array, ""]:
    """How far a time has advanced through its interval, from 0 to 1; held at the ends of the record."""
    part = (t - times[index]) / (times[index + 1] - times[index])
    return jnp.where(part < 0, 0.0, jnp.where(part > 1, 1.0, part))


def central_differences(times: Float[Array, " samples"], values: Float[Array, " samples"]) -> Float[Array, " samples"]:
    """Time derivative at the samples: second-order central differences on any grid, one-sided at the two ends."""
    step = jnp.diff(times)
    chord = jnp.diff(values) / step
    if times.size == 2:
        return jnp.stack([chord[0], chord[0]])
    before, after = step[:-1], step[1:]
    inner = (after * chord[:-1] + before * chord[1:]) / (before + after)
    first = chord[0] - (chord[1] - chord[0]) * step[0] / (step[0] + step[1])
    last = chord[-1] + (chord[-1] - chord[-2]) * step[-1] / (step[-1] + step[-2])
    return jnp.concatenate([first[None], inner, last[None]])


def ends_or_samples(times: Float[Array, " samples"], every_sample: bool) -> Float[Array, " switches"]:
    """The switching times of a record: all samples, or its two ends."""
    return times if every_sample else jnp.stack([times[0], times[-1]])


def check_shape(name: str, value: object, samples: int) -> None:
    """Raise unless an array has one entry (or row) for each sample.

    Raises:
        InputError: if it has not.
    """
    shape = getattr(value, "shape", ())
    if not isinstance(value, jax.Array) or len(shape) < 1 or shape[0] != samples:
        raise InputError(
            f"{name} must have one entry for each of the {samples} times, but has the shape {shape}. "
            "Check that both come from the same record."
        )


def check_below_nyquist(what: str, frequency: float | Float[Array, ""], sample_rate: float) -> None:
    """Raise unless a frequency [Hz] lies below half of a sample rate [Hz].

    Raises:
        InputError: if it does not, or the sample rate is not positive.
    """
    positive("sample_rate", sample_rate, "Hz")
    if not float(frequency) < sample_rate / 2:
        raise InputError(
            f"{what} reaches {float(frequency):g} Hz, beyond Nyquist: half the sample rate of {sample_rate:g} Hz is "
            f"{sample_rate / 2:g} Hz. Lower the highest frequency or sample faster."
        )
