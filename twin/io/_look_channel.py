"""Suspicious spots of one channel, and of its clock."""

import re
from typing import NamedTuple

import numpy as np

from twin.io._look_roles import role_of
from twin.io.measurement import MeasuredChannel

_SPIKE, _SPIKE_SPAN = 20.0, 0.05
_FEW_LEVELS = 64
_MAINS = (50.0, 60.0)
_HUM = 30.0
_LARGEST = 2_000_000
_ANGLE = re.compile(r"winkel|angle|theta|phi|rot", re.IGNORECASE)
# Beyond these a value in SI is unlikely for a feed drive; the unit that would be likely instead.
_UNLIKELY = {
    ("position", "m"): (20.0, "mm"),
    ("position", "rad"): (1000.0, "deg"),
    ("position", ""): (20.0, "mm"),
    ("speed", "m/s"): (20.0, "mm/s"),
    ("speed", "rad/s"): (2000.0, "1/min"),
    ("acceleration", "m/s^2"): (2000.0, "mm/s^2"),
    ("current", "A"): (2000.0, "mA"),
}


class Finding(NamedTuple):
    """One suspicious spot."""

    channel: str
    """Channel it concerns."""
    kind: str
    """What it is, in one word."""
    text: str
    """What was seen and what may be done."""


def clock_findings(channel: MeasuredChannel) -> list[Finding]:
    """What is wrong with the abscissa of a channel.

    Args:
        channel: a channel with times.
    """
    times, name = channel.times, f"{channel.abscissa} of {channel.name!r}"
    if times is None or times.size < 3:
        return []
    found = []
    unit = "Hz" if channel.abscissa == "frequency" else "s"
    if not np.all(np.isfinite(times)):
        count = int(np.count_nonzero(~np.isfinite(times)))
        found.append(Finding(name, "clock", f"{count} entries are missing."))
        times = times[np.isfinite(times)]
    steps = np.diff(times)
    median = float(np.median(steps)) if steps.size else 0.0
    for kind, where in (("backwards", steps < 0), ("repeated", steps == 0)):
        at = np.flatnonzero(where)
        if at.size:
            told = "runs backwards" if kind == "backwards" else "stands still"
            found.append(Finding(name, kind, f"{told} {at.size} times, first at {times[at[0]]:.6g} {unit}."))
    gaps = np.flatnonzero(steps > 1.5 * median) if median > 0 and channel.abscissa == "time" else np.empty(0, int)
    if 0 < gaps.size <= 0.05 * steps.size:
        longest = gaps[np.argmax(steps[gaps])]
        found.append(
            Finding(
                name,
                "gap",
                f"{gaps.size} gap{'s' * (gaps.size > 1)}, the longest of {steps[longest]:.4g} s after "
                f"{times[longest]:.6g} s. Say how to treat them by gaps (refuse, fill, longest).",
            )
        )
    elif gaps.size:
        found.append(Finding(name, "jitter", "the clock jitters by more than half a period; it will be resampled."))
    if channel.abscissa == "time" and median >= 0.5 and times.size > 200 and np.ptp(times) > 1000:
        found.append(Finding(name, "unit", f"lasts {np.ptp(times):.4g} s at {1 / median:.3g} Hz: is it in ms?"))
    return found


def channel_findings(channel: MeasuredChannel) -> list[Finding]:
    """What is suspicious in the samples of a channel.

    Args:
        channel: the channel.
    """
    name, values = channel.name, channel.values
    bad = np.flatnonzero(~np.isfinite(values))
    found = []
    if bad.size:
        found.append(Finding(name, "missing", f"{bad.size} samples are not finite, first sample {bad[0] + 1}."))
    if values.dtype.kind == "c" or channel.abscissa == "frequency":
        return found
    values = values[np.isfinite(values)][:_LARGEST]
    if values.size < 8:
        return [*found, Finding(name, "short", f"only {values.size} samples.")]
    span = float(np.ptp(values))
    if span == 0:
        return [*found, Finding(name, "constant", f"is {values[0]:.6g} throughout.")]
    told = (
        _clipping(values, span),
        _spikes(values, span, channel),
        _stuck(values),
        _quantum(values, span),
        _drift(values, channel),
        _unit(values, span, channel),
        _hum(values, channel),
    )
    return found + [Finding(name, *one) for one in told if one is not None]


def _runs(same: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First index and length of runs of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], same, [False]]).astype(np.int8)))
    return edges[::2], edges[1::2] - edges[::2]


def _clipping(values: np.ndarray, span: float) -> tuple[str, str] | None:
    slope = np.abs(np.diff(values))
    usual = float(np.median(slope[slope > 0]))
    if np.count_nonzero(slope) < 0.02 * values.size or np.unique(values[:10_000]).size < 8:
        return None  # a switch has no other values
    for end, told in ((values.max(), "largest"), (values.min(), "smallest")):
        starts, lengths = _runs(values == end)
        long = (lengths >= 3) & (starts > 0)
        # Into a stop of the amplifier a signal runs at full slope; where it turns or rests it arrives slowly.
        steep = [start for start in starts[long] if slope[start - 1] > 0.3 * usual and slope[start - 1] > 1e-9 * span]
        if steep and len(steep) > 0.5 * np.count_nonzero(long):
            return "clipping", f"stops {len(steep)} times at its {told} value {end:.6g}: clipped?"
    return None


def _spikes(values: np.ndarray, span: float, channel: MeasuredChannel) -> tuple[str, str] | None:
    middle = np.median(np.stack([values[:-2], values[1:-1], values[2:]]), axis=0)
    rest = np.abs(values[1:-1] - middle)
    scatter = 1.4826 * float(np.median(rest[rest > 0])) if np.any(rest > 0) else 0.0
    sides = np.abs(values[2:] - values[:-2])
    at = np.flatnonzero((rest > _SPIKE * scatter) & (rest > _SPIKE_SPAN * span) & (sides < 0.3 * rest))
    if at.size == 0:
        # A single spike is its own scatter.
        at = np.flatnonzero((rest > 0.3 * span) & (sides < 0.05 * rest) & (np.count_nonzero(rest > 0) < 5))
    if at.size == 0 or at.size > 0.01 * values.size + 1:
        return None
    first = at[0] + 1
    where = f"{channel.times[first]:.6g} s" if channel.times is not None else f"sample {first + 1}"
    return "spike", f"{at.size} single-sample spikes, first at {where} ({values[first]:.5g})."


def _stuck(values: np.ndarray) -> tuple[str, str] | None:
    same = np.diff(values) == 0
    starts, lengths = _runs(same)
    if lengths.size == 0:
        return None
    longest = int(np.argmax(lengths))
    length = int(lengths[longest]) + 1
    elsewhere = (np.count_nonzero(same) - lengths[longest]) / max(same.size - lengths[longest], 1)
    if length < max(50, 0.02 * values.size) or elsewhere > 0.2:
        return None
    return "stuck", f"holds {values[starts[longest]]:.6g} for {length} samples from sample {starts[longest] + 1} on."


def _quantum(values: np.ndarray, span: float) -> tuple[str, str] | None:
    levels = np.unique(values)
    if levels.size > values.size / 4 or levels.size < 3:
        return None
    quantum = float(np.min(np.diff(levels)))
    count = span / quantum
    if count > 1e5:
        return None
    coarse = ": coarse" if count < _FEW_LEVELS else ""
    return "resolution", f"is quantised in steps of {quantum:.4g}, {count:.0f} over its span{coarse}."


def _drift(values: np.ndarray, channel: MeasuredChannel) -> tuple[str, str] | None:
    role = (role_of(channel.name, channel.unit) or "").removesuffix("_setpoint")
    if role in ("position", "temperature") or values.size < 100:
        return None
    count = np.arange(values.size) / values.size - 0.5
    slope = float(12 * np.mean(count * values))
    scatter = float(np.std(values - slope * count))
    if abs(slope) < 2 * scatter:
        return None
    if abs(slope) > 1000 * scatter:
        return "counter", f"runs evenly from {values[0]:.6g} to {values[-1]:.6g}: a counter?"
    return "drift", f"drifts by {slope:.4g} over the record, {abs(slope) / max(scatter, 1e-300):.1f} times its scatter."


def _unit(values: np.ndarray, span: float, channel: MeasuredChannel) -> tuple[str, str] | None:
    role = (role_of(channel.name, channel.unit) or "").removesuffix("_setpoint")
    limit = _UNLIKELY.get((role, channel.unit))
    if limit is None:
        return None
    size = span if role == "position" else float(np.max(np.abs(values)))
    if size <= limit[0]:
        return None
    if role == "position" and not channel.unit and _ANGLE.search(channel.name):
        limit = (limit[0], "deg")
    unit = f" {channel.unit}" if channel.unit else ""
    return "unit", f"spans {span:.4g}{unit}, much for a {role} of a drive: is it in {limit[1]}?"


def _hum(values: np.ndarray, channel: MeasuredChannel) -> tuple[str, str] | None:
    if channel.abscissa != "time" or channel.rate is None or values.size < channel.rate or channel.rate < 130:
        return None
    window = np.hanning(values.size)
    amplitude = 2 * np.abs(np.fft.rfft((values - values.mean()) * window)) / window.sum()
    width = channel.rate / values.size
    frequency = np.arange(amplitude.size) * width
    for mains in _MAINS:
        line = float(np.max(amplitude[np.abs(frequency - mains) <= max(0.1, 2 * width)], initial=0.0))
        near = np.abs(frequency - mains)
        around = amplitude[(near > max(1.0, 6 * width)) & (near < max(8.0, 20 * width))]
        if around.size > 8 and line > _HUM * np.median(around) and line > 1.5 * np.max(around):
            return "hum", f"has a line of amplitude {line:.3g} at {mains:g} Hz: mains?"
    return None
