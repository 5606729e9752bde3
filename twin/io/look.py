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
    return ChannelFacts(channel.name, channel.unit, channel.values.size, rate, jitter, *map(float, figures))


def _table(facts: tuple[ChannelFacts, ...]) -> list[str]:
    rows: list[tuple[str, ...]] = [("channel", "unit", "samples", "rate [Hz]", "jitter", "min", "max", "mean", "rms")]
    for one in facts[:_MOST_ROWS]:
        rate = "" if one.rate is None else f"{one.rate:.6g}"
        jitter = "" if one.jitter is None else f"{100 * one.jitter if one.jitter > 1e-6 else 0:.2g} %"
        figures = (f"{value:.5g}" for value in (one.minimum, one.maximum, one.mean, one.rms))
        rows.append((one.name, one.unit or "?", str(one.samples), rate, jitter, *figures))
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
        key: None if isinstance(value, float) and not np.isfinite(value) else value
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
