"""A measured record: channels sampled on one common time axis, in SI units.

A record is checked once, when it is made; everything that works on it afterwards may rely on finite samples, times
that increase without a gap, and SI units.
"""

import re
from collections.abc import Collection, Mapping, Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, as_array, increasing

_MINIMUM_SAMPLES = 8
# A step this many times the median step is a gap: between one missing sample (2) and the jitter of a clock.
_GAP_FACTOR = 1.5
# The end points of a slice may miss a sample time by rounding, as 3 * 0.1 misses 0.3.
_TIME_ROUNDING = 1e-6
_SI_SYMBOLS = frozenset([*"msAKNJWCVFSTHΩ", "kg", "mol", "cd", "rad", "sr", "Hz", "Pa", "ohm", "Wb"])


class Record(eqx.Module):
    """Measured channels on one time axis. Make it by `Record.create`, which checks the samples."""

    times: Float[Array, " samples"]
    """Sample times t [s], strictly increasing, without a gap."""
    channels: dict[str, Float[Array, " samples"]]
    """Samples of each channel by name, in the SI unit that `units` gives."""
    channel_units: tuple[tuple[str, str], ...] = eqx.field(static=True)
    """Pairs of channel name and SI unit; read them through `units`."""
    name: str = eqx.field(static=True, default="record")
    """What the record is called in messages and plots."""

    @staticmethod
    def create(
        times: ArrayLike | Sequence,
        channels: Mapping[str, ArrayLike | Sequence],
        units: Mapping[str, str],
        *,
        name: str = "record",
    ) -> "Record":
        """Make a record of measured samples and check it.

        Args:
            times: sample times [s], shape (samples,), at least 8 of them.
            channels: samples by channel name, each of shape (samples,), in SI units.
            units: SI unit of each channel, such as "m/s", "N m", "rad", "1". Convert other units first, by
                `twin.io.units.to_si`.
            name: what to call the record in messages and plots.

        Returns:
            The record, in double precision.

        Raises:
            InputError: if there are too few samples, the times do not increase strictly, a step is longer than 1.5
                times the median step, a channel's length differs, a sample is NaN or infinite, or a unit is missing or
                is not an SI unit.
        """
        instants = _as_vector("times", times, name)
        _check_times(instants, name)
        _check_units(channels.keys(), units, name)
        samples = {channel: _as_vector(f"channel {channel!r}", values, name) for channel, values in channels.items()}
        for channel, values in samples.items():
            _check_samples(channel, values, instants.size, name)
        return Record(
            as_array(instants),
            {channel: as_array(values) for channel, values in samples.items()},
            tuple((channel, units[channel]) for channel in samples),
            name,
        )

    @property
    def units(self) -> dict[str, str]:
        """SI unit of each channel by name."""
        return dict(self.channel_units)

    @property
    def sample_period(self) -> Float[Array, ""]:
        """Median time between two samples [s]."""
        return jnp.median(jnp.diff(self.times))

    @property
    def sample_rate(self) -> Float[Array, ""]:
        """Samples per second [Hz], the inverse of the median sample period."""
        return 1.0 / self.sample_period

    def channel(self, name: str) -> Float[Array, " samples"]:
        """The samples of one channel.

        Raises:
            InputError: if the record has no such channel; the message lists those it has.
        """
        if name not in self.channels:
            raise InputError(
                f"{self.name} has no channel {name!r}; it has {', '.join(sorted(self.channels)) or 'none'}. "
                "Use one of these names, or add the channel by with_channel."
            )
        return self.channels[name]

    def slice(self, start: float | None = None, stop: float | None = None) -> "Record":
        """The samples with start <= t < stop; adjoining slices share no sample.

        Args:
            start: first time kept [s]; None keeps everything from the beginning.
            stop: first time left out [s]; None keeps everything to the end.

        Raises:
            InputError: if fewer than 8 samples remain.
        """
        times = np.asarray(self.times)
        rounding = _TIME_ROUNDING * float(self.sample_period)
        kept = np.ones(times.size, dtype=bool)
        if start is not None:
            kept &= times >= start - rounding
        if stop is not None:
            kept &= times < stop - rounding
        if np.count_nonzero(kept) < _MINIMUM_SAMPLES:
            raise InputError(
                f"slice(start={start}, stop={stop}) leaves {np.count_nonzero(kept)} samples of {self.name}, but at "
                f"least {_MINIMUM_SAMPLES} are needed. The record runs from {times[0]:g} s to {times[-1]:g} s; "
                "choose start and stop in seconds within it."
            )
        return self._pick(np.flatnonzero(kept))

    def decimate(self, n: int) -> "Record":
        """Every n-th sample, beginning with the first.

        Nothing is filtered: content above half the new sample rate folds down unless a low-pass took it out before.

        Args:
            n: decimation factor, at least 1.

        Raises:
            InputError: if n is below 1 or fewer than 8 samples remain.
        """
        largest = (self.times.size - 1) // (_MINIMUM_SAMPLES - 1)
        if not 1 <= n <= largest:
            raise InputError(
                f"the decimation factor must lie between 1 and {largest}, so that {_MINIMUM_SAMPLES} of the "
                f"{self.times.size} samples of {self.name} remain, but is {n}. Choose a smaller factor."
            )
        return self._pick(np.arange(0, self.times.size, n))

    def with_channel(self, name: str, values: ArrayLike | Sequence, unit: str) -> "Record":
        """The record with one channel more, or with that channel replaced.

        Args:
            name: name of the channel.
            values: samples, shape (samples,), in the SI unit given.
            unit: SI unit of the samples.

        Raises:
            InputError: as `create` does.
        """
        return Record.create(self.times, {**self.channels, name: values}, {**self.units, name: unit}, name=self.name)

    def _pick(self, index: np.ndarray) -> "Record":
        channels = {channel: values[index] for channel, values in self.channels.items()}
        return Record(self.times[index], channels, self.channel_units, self.name)


def _as_vector(what: str, values: ArrayLike | Sequence, name: str) -> np.ndarray:
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{what} of {name} must hold numbers, but {error}. Give a vector of real numbers.") from error
    if array.ndim != 1:
        raise InputError(
            f"{what} of {name} must be a vector, but has shape {array.shape}. Give one value per sample; "
            "flatten a column by ravel()."
        )
    return array


def _check_times(times: np.ndarray, name: str) -> None:
    if times.size < _MINIMUM_SAMPLES:
        raise InputError(
            f"{name} has {times.size} samples, but at least {_MINIMUM_SAMPLES} are needed to judge its sample period. "
            "Give a longer record."
        )
    increasing(f"times of {name}", times, "s")
    steps = np.diff(times)
    median = np.median(steps)
    gaps = np.flatnonzero(steps > _GAP_FACTOR * median)
    if gaps.size:
        first = gaps[0]
        raise InputError(
            f"{name} has {gaps.size} gap{'s' if gaps.size > 1 else ''}: the first lies after t = {times[first]:g} s "
            f"(index {first}) and lasts {steps[first]:g} s, where the median step is {median:g} s. "
            "Split the record there or resample it."
        )


def _check_samples(channel: str, values: np.ndarray, expected: int, name: str) -> None:
    if values.size != expected:
        raise InputError(
            f"channel {channel!r} of {name} has {values.size} samples, but times has {expected}. "
            "Give one sample per time."
        )
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise InputError(
            f"channel {channel!r} of {name} must be finite, but {bad.size} of {values.size} samples are NaN or "
            f"infinite (first at index {bad[0]}). Repair them or cut the record before them."
        )


def _check_units(channels: Collection[str], units: Mapping[str, str], name: str) -> None:
    missing = [channel for channel in channels if channel not in units]
    if missing:
        raise InputError(
            f'{name} gives no unit for channel {missing[0]!r}. Give its SI unit, or "1" for a plain number.'
        )
    unknown = [channel for channel in units if channel not in channels]
    if unknown:
        raise InputError(
            f"{name} gives a unit for {unknown[0]!r}, but has no such channel; it has {', '.join(channels) or 'none'}. "
            "Correct the name."
        )
    for channel, unit in units.items():
        if not _is_si(unit):
            raise InputError(
                f"channel {channel!r} of {name} has the unit {unit!r}, but a record holds SI units such as m, m/s, "
                "rad, N m, V or 1. Convert the samples by twin.io.units.to_si before making the record."
            )


def _is_si(unit: str) -> bool:
    symbols = re.findall(r"[A-Za-zΩ]+", unit)
    rest = re.sub(r"[A-Za-zΩ]+", "", unit)
    return bool(unit.strip()) and set(symbols) <= _SI_SYMBOLS and re.fullmatch(r"[\s*·/^()0-9²³+-]*", rest) is not None
