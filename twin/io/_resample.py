"""Samples and their clock: repaired, looked through for gaps, brought to another axis."""

from typing import NamedTuple

import numpy as np

from twin._checks import InputError

# A step this many times the median step is a gap, as for a record; a clock that jitters may exceed it.
_GAP_FACTOR, _JITTER = 1.5, 8.0
_EVEN = 1e-2
_COARSE = 0.1
# Half width of the low-pass in samples of the new rate, and its transition: over 90 dB beyond half the new rate.
_HALF_WIDTH, _TRANSITION = 25, 0.12


class Hole(NamedTuple):
    """Where samples are missing."""

    start: float
    """Time of the last sample before [s]."""
    stop: float
    """Time of the next sample [s]."""
    missing: int
    """How many samples are missing."""


class Samples(NamedTuple):
    """Finite samples at increasing times."""

    times: np.ndarray
    """Times [s]."""
    values: np.ndarray
    """Values, in SI."""

    @property
    def rate(self) -> float:
        """Samples per second, without gaps [Hz]."""
        steps = np.diff(self.times)
        usual = steps[steps <= _threshold(steps)]
        return float(1.0 / usual.mean())

    @property
    def even(self) -> bool:
        """Whether every sample lies at its place in an even grid."""
        grid = np.linspace(self.times[0], self.times[-1], self.times.size)
        return bool(np.max(np.abs(self.times - grid)) <= _EVEN / self.rate)

    def between(self, low: float, high: float, stop: float | None) -> "Samples":
        """The samples from low to high, without those at stop."""
        rounding = 1e-6 / self.rate
        kept = (self.times >= low - rounding) & (self.times <= high + rounding)
        if stop is not None:
            kept &= self.times < stop - rounding
        return Samples(self.times[kept], self.values[kept])

    def filled(self) -> "Samples":
        """With missing samples on straight lines."""
        holes = gaps_of(self, self.times[0], self.times[-1])
        new = [
            hole.start + (hole.stop - hole.start) * np.arange(1, hole.missing + 1) / (hole.missing + 1)
            for hole in holes
        ]
        times = np.sort(np.concatenate([self.times, *new]))
        return Samples(times, np.interp(times, self.times, self.values))


def clean_clock(times: np.ndarray, values: np.ndarray, channel: str, source: str, told: list[str]) -> Samples:
    """Samples without NaN, repeated times and coarse stamps.

    Args:
        times: times [s], as recorded.
        values: samples.
        channel: name of the channel, for messages.
        source: the file, for messages.
        told: what is changed is added here.

    Raises:
        InputError: times that run backwards, or fewer than 8 samples.
    """
    finite = np.isfinite(times) & np.isfinite(values)
    if not finite.all():
        told.append(f"{channel}: {np.count_nonzero(~finite)} samples are not finite and count as missing.")
        times, values = times[finite], values[finite]
    if times.size < 8:
        raise InputError(f"Channel {channel!r} of {source!r} has {times.size} finite samples; at least 8 are needed.")
    steps = np.diff(times)
    backward = np.flatnonzero(steps < 0)
    if backward.size:
        raise InputError(
            f"The times of channel {channel!r} of {source!r} run backwards {backward.size} times, first after "
            f"{times[backward[0]]:g} s (sample {backward[0] + 1}). Several runs may be joined in the file: split it "
            "there, or give start and stop on a file that is sorted."
        )
    repeated = np.flatnonzero(steps == 0)
    if repeated.size > _COARSE * times.size:
        return _spread(times, values, channel, source, told)
    if repeated.size:
        told.append(f"{channel}: {repeated.size} samples with the time of the one before are dropped.")
        kept = np.append(True, steps > 0)
        times, values = times[kept], values[kept]
    return Samples(times, values)


def _spread(times: np.ndarray, values: np.ndarray, channel: str, source: str, told: list[str]) -> Samples:
    """Stamps coarser than the sampling: an even clock is laid through them."""
    count = np.arange(times.size)
    step, start = np.polyfit(count, times, 1)
    stamps = np.unique(times)
    resolution = float(np.median(np.diff(stamps))) if stamps.size > 1 else 0.0
    if stamps.size < 8 or np.max(np.abs(times - start - step * count)) > 2 * resolution:
        raise InputError(
            f"Many times of channel {channel!r} of {source!r} are repeated, and no even clock fits them. Give the "
            "sample rate and no time column, or export the times with more digits."
        )
    told.append(
        f"{channel}: times are stamped coarser than the sampling; an even clock of {1 / step:.6g} Hz is assumed."
    )
    return Samples(start + step * count, values)


def gaps_of(samples: Samples, low: float, high: float) -> list[Hole]:
    """Where samples are missing between two times.

    Args:
        samples: the samples.
        low: begin of what is looked at [s].
        high: its end [s].
    """
    steps = np.diff(samples.times)
    usual = 1 / samples.rate
    found = np.flatnonzero(steps > _threshold(steps))
    return [
        Hole(float(samples.times[i]), float(samples.times[i + 1]), max(1, round(steps[i] / usual) - 1))
        for i in found
        # Only if a sample that is missing would lie between.
        if samples.times[i + 1] > low + 0.5 * usual and samples.times[i] + usual < high - 1e-6 * usual
    ]


def _threshold(steps: np.ndarray) -> float:
    median = float(np.median(steps))
    # The spread of half the steps about their median does not see the gaps themselves.
    spread = float(np.median(np.abs(steps - median)))
    return max(_GAP_FACTOR * median, median + _JITTER * spread)


def resampled(samples: Samples, times: np.ndarray, rate: float) -> np.ndarray:
    """The values at other times.

    Args:
        samples: the samples, without gaps where they are wanted.
        times: times wanted [s], within those of the samples, evenly spaced.
        rate: samples per second wanted [Hz].
    """
    from scipy.interpolate import make_interp_spline

    own = samples.rate
    if rate < own * (1 - 1e-6):
        samples = _low_passed(samples, own, rate)
    return make_interp_spline(samples.times, samples.values, k=3)(np.clip(times, *samples.times[[0, -1]]))


def _low_passed(samples: Samples, own: float, rate: float) -> Samples:
    """Without what would fold down: a symmetric filter on an even grid, so that no phase is turned."""
    from scipy.interpolate import make_interp_spline
    from scipy.signal import firwin, oaconvolve

    if not samples.even:
        count = int((samples.times[-1] - samples.times[0]) * own) + 1
        grid = samples.times[0] + np.arange(count) / own
        samples = Samples(grid, make_interp_spline(samples.times, samples.values, k=3)(grid))
    half = min(int(np.ceil(_HALF_WIDTH * own / rate)), samples.values.size - 1)
    taps = firwin(2 * half + 1, 0.4 * rate, fs=own, width=_TRANSITION * rate)
    # Reflected about its end points, a trend goes on beyond the ends instead of bending there.
    padded = np.pad(samples.values, half, mode="reflect", reflect_type="odd")
    return Samples(samples.times, oaconvolve(padded, taps, mode="valid"))
