"""Sections: the data at a glance."""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from fitting.report.content import Cell, Figure, Section, Table, number_cells
from fitting.report.numbers import given, plain
from fitting.report.thinning import thinned
from twin.record import Record

_MOST_TRACES = 8


def records_section(records: Mapping[str, Record], remarks: Mapping[str, Sequence[str]] | None = None) -> Section:
    """Each record: channels, units, rate, samples, ranges, traces, and what was done to it.

    Args:
        records: records by name.
        remarks: remarks on their preparation, by record.
    """
    rows = []
    for name, record in records.items():
        for channel, samples in record.channels.items():
            values = np.asarray(samples)
            numbers = (values.min(), values.max(), values.mean(), values.std())
            names = (Cell(name), Cell(channel, "name"), Cell(record.units[channel], "unit"))
            rows.append((*names, *number_cells(plain(float(x)) for x in numbers)))
    head = ("Record", "Channel", "Unit", "Least", "Greatest", "Mean", "Standard deviation")
    words = [f"{name}: {remark}" for name, lines in (remarks or {}).items() for remark in lines]
    too_many = [name for name, record in records.items() if len(record.channels) > _MOST_TRACES]
    if too_many:
        words.append(f"Only the first {_MOST_TRACES} channels are drawn of {', '.join(too_many)}.")
    return Section(
        "Data at a glance",
        figures=tuple(_traces(name, record) for name, record in records.items()),
        tables=(_overview(records), Table(head, tuple(rows), "Channels")),
        remarks=tuple(words),
    )


def _overview(records: Mapping[str, Record]) -> Table:
    head = ("Record", "Samples", "Rate [Hz]", "From [s]", "To [s]")
    rows = []
    for name, record in records.items():
        times = np.asarray(record.times)
        samples = f"{times.size:,}".replace(",", " ")
        numbers = (samples, *(given(float(x)) for x in (record.sample_rate, times[0], times[-1])))
        rows.append((Cell(name), *number_cells(numbers)))
    return Table(head, tuple(rows), "Records")


def _traces(name: str, record: Record) -> Figure:
    channels = list(record.channels)[:_MOST_TRACES]
    return Figure(
        draw=partial(_draw, record, channels),
        alt=f"Traces of {', '.join(channels)} over time, record {name}",
        caption=f"{name}: measured channels over time.",
        panels=len(channels),
        wide=True,
        height=1.35,
    )


def _draw(record: Record, channels: list[str], axes: np.ndarray) -> None:
    times = np.asarray(record.times)
    for ax, channel in zip(axes, channels, strict=True):
        values = np.asarray(record.channel(channel))
        kept = thinned(ax, values)
        ax.plot(times[kept], values[kept], color="0.35", lw=0.8)
        ax.set_title(f"{channel} [{record.units[channel]}]", loc="left", fontsize=8.5, color="0.3")
        ax.margins(x=0)
    axes[-1].set_xlabel("time [s]")
