"""A first look at a measurement: its channels in figures, what is suspicious, and how to name them in a study."""

import json
import re
from typing import Any, NamedTuple

import numpy as np

from twin._checks import InputError
from twin.io._look_channel import Finding, channel_findings, clock_findings
from twin.io._look_pairs import pair_findings
from twin.io._look_roles import model_name
from twin.io._response_columns import named_responses
from twin.io.measurement import MeasuredChannel, Measurement

_MOST_ROWS = 60


class Lines(NamedTuple):
    """Over which frequencies a channel is given."""

    first: float
    """First frequency [Hz]."""
    last: float
    """Last frequency [Hz]."""
    step: float
    """Median distance of two lines [Hz]."""


class ChannelFacts(NamedTuple):
    """What is said of one channel."""

    name: str
    """Its name."""
    unit: str
    """Its unit, as the file says."""
    samples: int
    """How many samples."""
    rate: float | None
    """Samples per second [Hz]; None without a time axis."""
    jitter: float | None
    """Standard deviation of the sample period over its median; None without a time axis."""
    minimum: float
    """Smallest value; NaN if none is finite. Of spectra: of the magnitude."""
    maximum: float
    """Largest value."""
    mean: float
    """Mean."""
    rms: float
    """Root mean square."""
    lines: Lines | None = None
    """Over which frequencies; None for channels over time."""


class Look(NamedTuple):
    """What a look has found."""

    measurement: Measurement
    """What was looked at."""
    facts: tuple[ChannelFacts, ...]
    """One row a channel."""
    findings: tuple[Finding, ...]
    """What is suspicious."""
    study: str
    """Lines for a study file that name the channels; empty for spectra."""

    def text(self) -> str:
        """All of it for a reader."""
        name = self.measurement
        lines = [f"{name.source}: {name.format}, {len(name)} channels", *(f"  {told}" for told in name.remarks), ""]
        layout = _layout(name)
        lines += [f"Layout: {layout}.", ""] if layout else []
        lines += _table(self.facts)
        if self.findings:
            lines += ["", "Worth a look:", *(f"  {finding.channel}: {finding.text}" for finding in self.findings)]
        else:
            lines += ["", "Nothing suspicious was found."]
        if self.study:
            lines += ["", "In a study file (check names and units, leave out what is not needed):", "", self.study]
        return "\n".join(lines)

    def summary(self) -> dict[str, Any]:
        """All of it for a program."""
        return {
            "file": self.measurement.source,
            "format": self.measurement.format,
            "remarks": list(self.measurement.remarks),
            "layout": _layout(self.measurement),
            "channels": [_plain(facts) for facts in self.facts],
            "findings": [finding._asdict() for finding in self.findings],
            "study": self.study,
        }


def look(measurement: Measurement) -> Look:
    """Look at a measurement.

    Args:
        measurement: what `twin.io.measurement.read_measurement` has read.

    Returns:
        Figures of each channel, suspicious spots, and lines for a study file.
    """
    findings: list[Finding] = []
    seen: set[int] = set()
    with np.errstate(all="ignore"):
        for channel in measurement:
            if channel.times is not None and id(channel.times) not in seen:
                seen.add(id(channel.times))
                findings += clock_findings(channel)
        for channel in measurement:
            findings += channel_findings(channel)
        findings += pair_findings(measurement)
        facts = tuple(_facts(channel) for channel in measurement)
    return Look(measurement, facts, tuple(findings), _study(measurement))


def _facts(channel: MeasuredChannel) -> ChannelFacts:
    values = np.abs(channel.values) if channel.values.dtype.kind == "c" else channel.values
    values = values[np.isfinite(values)]
    figures = (np.nan,) * 4
    if values.size:
        figures = (values.min(), values.max(), values.mean(), np.sqrt(np.mean(np.square(values))))
    jitter = None
    if channel.abscissa == "time" and channel.times is not None and channel.times.size > 2:
        steps = np.diff(channel.times)
        median = np.median(steps)
        usual = steps[(steps > 0) & (steps < 1.9 * median)]  # gaps are told elsewhere
        jitter = float(np.std(usual) / median) if usual.size and median > 0 else None
    rate = channel.rate if channel.abscissa == "time" else None
    lines = None
    if channel.abscissa == "frequency" and channel.times is not None and channel.times.size > 1:
        times = channel.times
        lines = Lines(float(times[0]), float(times[-1]), float(np.median(np.diff(times))))
    return ChannelFacts(
        channel.name, channel.unit, channel.values.size, rate, jitter, *map(float, figures), lines=lines
    )


def _layout(measurement: Measurement) -> str:
    """How many responses to how many excitations a file of frequency responses has; empty for any other."""
    pairs = {tuple(one.name.split("/", 1)) for one in measurement if one.values.dtype.kind == "c" and "/" in one.name}
    if not pairs:
        return ""
    outputs, inputs = (len({pair[i] for pair in pairs}) for i in (0, 1))
    there = "" if len(pairs) == outputs * inputs else f", {outputs * inputs - len(pairs)} missing"
    return (
        f"{outputs} response{'s' * (outputs > 1)} x {inputs} excitation{'s' * (inputs > 1)}"
        f" ({outputs * inputs} frequency responses{there})"
    )


def _table(facts: tuple[ChannelFacts, ...]) -> list[str]:
    spectra = all(one.lines is not None for one in facts)
    abscissa = ("lines", "first [Hz]", "last [Hz]", "step [Hz]") if spectra else ("samples", "rate [Hz]", "jitter")
    figures = ("smallest", "largest", "mean", "rms") if spectra else ("min", "max", "mean", "rms")
    rows: list[tuple[str, ...]] = [("channel", "unit", *abscissa, *figures)]
    for one in facts[:_MOST_ROWS]:
        if spectra and one.lines is not None:
            place = tuple(f"{value:.6g}" for value in one.lines)
        else:
            rate = "" if one.rate is None else f"{one.rate:.6g}"
            place = (rate, "" if one.jitter is None else f"{100 * one.jitter if one.jitter > 1e-6 else 0:.2g} %")
        values = (f"{value:.5g}" for value in (one.minimum, one.maximum, one.mean, one.rms))
        rows.append((one.name, one.unit or "?", str(one.samples), *place, *values))
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = [
        "  ".join(
            cell.ljust(w) if i < 2 else cell.rjust(w) for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    ]
    more = len(facts) - _MOST_ROWS
    return [line.rstrip() for line in lines] + ([f"... and {more} more channels"] if more > 0 else [])


def _plain(facts: ChannelFacts) -> dict[str, Any]:
    return {
        key: None
        if isinstance(value, float) and not np.isfinite(value)
        else value._asdict()
        if isinstance(value, Lines)
        else value
        for key, value in facts._asdict().items()
    }


def _study(measurement: Measurement) -> str:
    if responses := _responses(measurement):
        return responses
    chosen = [one for one in measurement if one.abscissa != "frequency" and one.values.dtype.kind == "f"]
    if not chosen:
        return ""
    name = re.sub(r"[^A-Za-z0-9_-]+", "_", measurement.name).strip("_") or "run1"
    lines = [f"[data.{name}]", f"file = {_quoted(measurement.source)}"]
    if all(one.times is None for one in chosen):
        lines.append('time = ""  # name of the time column, or give rate = samples per second')
    lines.append(f"[data.{name}.channels]")
    used: dict[str, int] = {}
    for one in chosen[:_MOST_ROWS]:
        role = model_name(one.name, one.unit) or re.sub(r"[^A-Za-z0-9_-]+", "_", one.name).strip("_") or "channel"
        used[role] = used.get(role, 0) + 1
        key = role if used[role] == 1 else f"{role}_{used[role]}"
        missing = "" if one.unit else "  # the file states no unit: fill it in"
        lines.append(f"{key} = {{ column = {_quoted(one.name)}, unit = {_quoted(one.unit)} }}{missing}")
    return "\n".join(lines)


def _responses(measurement: Measurement) -> str:
    """Lines of a table of frequency responses; empty where it is none."""
    if not all(one.abscissa == "frequency" for one in measurement) or measurement.format == "universal":
        return ""
    try:
        pairs = list(named_responses(measurement))
    except InputError:
        return ""
    name = re.sub(r"[^A-Za-z0-9_-]+", "_", measurement.name).strip("_") or "response"
    outputs, inputs = (tuple(dict.fromkeys(pair[i] for pair in pairs)) for i in (0, 1))
    lines = [f"[data.{name}]", 'kind = "frf"', f"file = {_quoted(measurement.source)}"]
    for kind, names in (("outputs", outputs), ("inputs", inputs)):
        listed = ", ".join(f"{_quoted(one)} = {_quoted(one)}" for one in names)
        lines.append(f"{kind} = {{ {listed} }}  # the model's name = the measured name")
    return "\n".join(lines)


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)  # a basic string of TOML is escaped like one of JSON
