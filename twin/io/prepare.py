"""From what a file holds to a record: units, signs, delays, gaps, clocks and rates, every change told."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from twin._checks import InputError
from twin.io._resample import Samples, clean_clock, gaps_of, resampled
from twin.io.measurement import MeasuredChannel, Measurement
from twin.io.units import si_unit, to_si
from twin.record import Record

_FILLED = 10
_SAME_CLOCK = 1e-6


@dataclass(frozen=True)
class ChannelChoice:
    """Which column of a measurement becomes a channel, and what is done to it.

    The value in SI is `sign * to_si(scale * raw, unit) + offset`, taken `delay` seconds later in the file.
    """

    column: str
    """Name of the channel in the measurement."""
    unit: str | None = None
    """Unit of its values; None takes the file's."""
    expected: str | None = None
    """A unit of the dimension the channel must have, such as "m"; None takes any."""
    sign: float = 1.0
    """1 or -1: which way is positive."""
    offset: float = 0.0
    """Added after conversion, in SI."""
    delay: float = 0.0
    """By how much the channel lags behind the others [s]; it is shifted back by interpolation."""
    detrend: Literal["none", "mean", "linear"] = "none"
    """What is taken off the finished channel: nothing, its mean, or its straight line."""
    scale: float | None = None
    """Factor on the raw values before their unit counts, as of a sensor; None for 1."""

    def __post_init__(self):
        if self.sign not in (1.0, -1.0):
            raise InputError(
                f"sign of column {self.column!r} must be 1 or -1, but is {self.sign}. Use scale for gains."
            )
        if self.detrend not in ("none", "mean", "linear"):
            raise InputError(f"detrend of column {self.column!r} must be none, mean or linear, not {self.detrend!r}.")
        for name in ("offset", "delay", "scale"):
            value = getattr(self, name)
            if value is not None and not math.isfinite(value):
                raise InputError(f"{name} of column {self.column!r} must be finite, but is {value}. Correct it.")


class Prepared(NamedTuple):
    """A record and how it came about."""

    record: Record
    """The record, in SI on one time axis."""
    remarks: tuple[str, ...]
    """What was read, assumed and changed, one sentence each."""


def prepare(
    measurement: Measurement,
    channels: Mapping[str, ChannelChoice],
    *,
    time: str | tuple[str, str] | None = None,
    start: float | None = None,
    stop: float | None = None,
    rate: float | None = None,
    gaps: Literal["refuse", "fill", "longest"] = "refuse",
    name: str | None = None,
) -> Prepared:
    """Make a record of chosen channels.

    Channels of different clocks are brought to one even axis: below their own rate by a zero-phase low-pass and cubic
    splines, above it by cubic splines alone. Channels of one even clock are left as they are.

    Args:
        measurement: what was read.
        channels: for each channel of the record the column it comes from.
        time: column of the measurement that holds the time, or the column and its unit; None takes the channels' own.
        start: first time kept [s]; None for the beginning.
        stop: first time left out [s]; None for the end.
        rate: samples per second of the record [Hz]; None keeps the clock, or takes the highest rate of several. For
            channels without any time it is the rate they were sampled at.
        gaps: what to do where samples are missing or NaN: "refuse"; "fill" those of up to 10 samples by straight
            lines; or keep the "longest" stretch without.
        name: what to call the record; None takes the measurement's.

    Returns:
        The record and the remarks.

    Raises:
        InputError: an unknown column, a unit that is unknown or of another dimension, no time axis, times that run
            backwards, gaps that may not be filled, or too little left.
    """
    if not channels:
        raise InputError(f"No channel of {measurement.source!r} is chosen. Name at least one.")
    if gaps not in ("refuse", "fill", "longest"):
        raise InputError(f"gaps must be refuse, fill or longest, but is {gaps!r}.")
    if rate is not None and not (math.isfinite(rate) and rate > 0):
        raise InputError(f"rate must be positive [Hz], but is {rate}.")
    told: list[str] = list(measurement.remarks)
    axis = _chosen_axis(measurement, time)
    found: dict[str, Samples] = {}
    units: dict[str, str] = {}
    for channel, choice in channels.items():
        column = measurement[choice.column]
        values, units[channel] = _in_si(column, channel, choice, measurement, told)
        times = _times_of(column, axis, rate, measurement)
        found[channel] = clean_clock(times - choice.delay, values, channel, measurement.source, told)
        if choice.delay:
            told.append(f"{channel}: shifted by {-choice.delay:g} s for its delay.")
    low, high = _span(found, start, stop, measurement)
    found, low, high = _without_gaps(found, low, high, gaps, measurement, told)
    times, values = _on_one_axis(found, low, high, rate, stop, measurement, told)
    for channel, choice in channels.items():
        values[channel] = _detrended(times, values[channel], choice.detrend)
        if choice.detrend != "none":
            told.append(f"{channel}: its {choice.detrend} is taken off.")
    record = Record.create(times, values, units, name=measurement.name if name is None else name)
    return Prepared(record, tuple(told))


def _in_si(
    column: MeasuredChannel, channel: str, choice: ChannelChoice, measurement: Measurement, told: list[str]
) -> tuple[np.ndarray, str]:
    if column.values.dtype.kind == "c" or column.abscissa == "frequency":
        raise InputError(
            f"Column {column.name!r} of {measurement.source!r} is a spectrum, but channel {channel!r} needs samples "
            "over time. Read it by twin.io.frf_table.read_frf."
        )
    label = f"channel {channel!r} (column {column.name!r} of {measurement.source!r})"
    unit = choice.unit or column.unit
    if not unit:
        raise InputError(f"{label} has no unit, and the file states none. Give its unit, such as 'mm'.")
    if choice.unit and column.unit and not _same_unit(choice.unit, column.unit):
        told.append(f"Warning: {channel}: the file says {column.unit!r}, but {choice.unit!r} was given and is used.")
    raw = column.values if choice.scale is None else choice.scale * column.values
    values = choice.sign * to_si(raw, unit, choice.expected, name=label) + choice.offset
    si = si_unit(unit, choice.expected, name=label)
    changes = [
        text
        for text, applies in (
            (f"times {choice.scale}", choice.scale is not None),
            (f"from {unit} to {si}", unit != si),
            ("turned round", choice.sign < 0),
            (f"offset {choice.offset:g} {si}", choice.offset != 0),
        )
        if applies
    ]
    told.append(f"{channel}: column {column.name!r}{', ' if changes else ''}{', '.join(changes)}.")
    return values, si


def _same_unit(one: str, other: str) -> bool:
    try:
        return si_unit(one) == si_unit(other) and bool(np.isclose(to_si(1.0, one), to_si(1.0, other), rtol=1e-9))
    except InputError:
        return one.strip() == other.strip()


def _chosen_axis(measurement: Measurement, time: str | tuple[str, str] | None) -> np.ndarray | None:
    if time is None:
        return None
    name, unit = (time, None) if isinstance(time, str) else time
    column = measurement[name]
    unit = unit or column.unit or "s"
    return to_si(column.values, unit, "s", name=f"time column {name!r} of {measurement.source!r}")


def _times_of(
    column: MeasuredChannel, axis: np.ndarray | None, rate: float | None, measurement: Measurement
) -> np.ndarray:
    if axis is not None:
        if axis.size != column.values.size:
            raise InputError(
                f"The time column of {measurement.source!r} has {axis.size} samples, but column {column.name!r} has "
                f"{column.values.size}. Choose the time column that belongs to it."
            )
        return axis
    if column.times is not None:
        return column.times
    if rate is None:
        raise InputError(
            f"Column {column.name!r} of {measurement.source!r} has no time axis. Name the time column by time, or give "
            "the sample rate by rate."
        )
    return np.arange(column.values.size) / rate


def _span(
    found: Mapping[str, Samples], start: float | None, stop: float | None, measurement: Measurement
) -> tuple[float, float]:
    low = max(one.times[0] for one in found.values())
    high = min(one.times[-1] for one in found.values())
    if start is not None:
        low = max(low, start)
    if stop is not None:
        high = min(high, stop)
    if not low < high:
        ends = ", ".join(f"{name} {one.times[0]:g} to {one.times[-1]:g} s" for name, one in found.items())
        raise InputError(
            f"The channels of {measurement.source!r} share no time between start and stop ({ends}). Choose others, or "
            "correct start, stop and delay."
        )
    return float(low), float(high)


def _without_gaps(
    found: dict[str, Samples], low: float, high: float, gaps: str, measurement: Measurement, told: list[str]
) -> tuple[dict[str, Samples], float, float]:
    holes = [(hole, channel) for channel, one in found.items() for hole in gaps_of(one, low, high)]
    if not holes:
        return found, low, high
    longest = max(holes, key=lambda pair: pair[0].missing)
    many = f"{len(holes)} gap{'s' if len(holes) > 1 else ''}, the longest of {longest[0].missing} samples"
    many += f" in {longest[1]!r} from {longest[0].start:g} to {longest[0].stop:g} s"
    if gaps == "refuse":
        raise InputError(
            f"{measurement.source!r} has {many}. Use gaps='fill' for short ones, gaps='longest' for the longest "
            "stretch without, or choose start and stop around them."
        )
    if gaps == "fill":
        if longest[0].missing > _FILLED:
            raise InputError(
                f"{measurement.source!r} has {many}; only up to {_FILLED} samples are filled. Use gaps='longest', or "
                "choose start and stop around it."
            )
        told.append(f"{many[0].upper()}{many[1:]}: filled by straight lines.")
        return {channel: one.filled() for channel, one in found.items()}, low, high
    edges = sorted({low, high, *(hole.start for hole, _ in holes), *(hole.stop for hole, _ in holes)})
    stretches = [
        (first, last)
        for first, last in itertools.pairwise(edges)
        if not any(hole.start < last and hole.stop > first for hole, _ in holes)
    ]
    if not stretches:
        raise InputError(f"{measurement.source!r} has {many}, and no stretch without. Repair the file.")
    low, high = max(stretches, key=lambda stretch: stretch[1] - stretch[0])
    told.append(f"{many[0].upper()}{many[1:]}: only {low:g} to {high:g} s, the longest stretch without, is kept.")
    return found, low, high


def _on_one_axis(
    found: Mapping[str, Samples],
    low: float,
    high: float,
    rate: float | None,
    stop: float | None,
    measurement: Measurement,
    told: list[str],
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    cut = {channel: one.between(low, high, stop) for channel, one in found.items()}
    first = next(iter(cut.values()))
    step = 1 / first.rate
    same = all(
        one.times.size == first.times.size and np.allclose(one.times, first.times, rtol=0, atol=_SAME_CLOCK * step)
        for one in cut.values()
    )
    if same and first.even and (rate is None or math.isclose(rate, first.rate, rel_tol=1e-6)):
        return first.times, {channel: one.values for channel, one in cut.items()}
    new = rate or max(one.rate for one in found.values())
    rounding = 1e-6 / new
    times = low + np.arange(int((high - low) * new + 1 + 1e-6)) / new
    if stop is not None:
        times = times[times < stop - rounding]
    if times.size < 8:
        raise InputError(f"Only {times.size} samples of {measurement.source!r} are left at {new:g} Hz. Keep more.")
    for channel, one in found.items():
        if one.rate > new * (1 + 1e-6):
            told.append(f"{channel}: from {one.rate:.6g} to {new:.6g} Hz, low-pass at {0.4 * new:.4g} Hz before.")
        elif not math.isclose(one.rate, new, rel_tol=1e-6) or not one.even:
            told.append(f"{channel}: from {one.rate:.6g} to an even {new:.6g} Hz by cubic splines.")
        else:
            told.append(f"{channel}: moved onto the common axis by cubic splines.")
    return times, {channel: resampled(one, times, new) for channel, one in found.items()}


def _detrended(times: np.ndarray, values: np.ndarray, how: str) -> np.ndarray:
    if how == "mean":
        return values - values.mean()
    if how == "linear":
        middle = times - times.mean()
        return values - values.mean() - middle * (middle @ values) / (middle @ middle)
    return values
