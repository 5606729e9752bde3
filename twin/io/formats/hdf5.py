"""HDF5: datasets are channels, their attributes tell unit and sample rate."""

from pathlib import Path
from typing import Any

import numpy as np

from twin.io.formats._abscissa import even_times, with_abscissa
from twin.io.formats._hdf5_walk import SafeHdf5
from twin.io.formats._mat_tree import HDF5_MARK
from twin.io.formats._shared import Column, check_count, columns_of, finite_number, printable
from twin.io.measurement import MeasuredChannel

ENDINGS = (".h5", ".hdf5", ".hdf", ".he5", ".nxs")


def matches(head: bytes) -> int:
    """Whether these first bytes are those of an HDF5 file that is no MAT-file."""
    if head.startswith(b"MATLAB"):
        return 0
    return 2 if any(head[start:].startswith(HDF5_MARK) for start in (0, 512, 1024, 2048)) else 0


def read(
    file: Path, limit: int, *, time: str | None = None, time_unit: str | None = None, rate: float | None = None
) -> tuple[list[MeasuredChannel], list[str]]:
    """Read the datasets of numbers.

    Links to elsewhere, datasets kept in other files and filters that are not built in are left out and told.

    Args:
        file: the file.
        limit: bytes that may be read.
        time: path of the time dataset, such as "run1/time"; None finds it in each group.
        time_unit: unit of the time; None takes the dataset's.
        rate: samples per second, for datasets without attribute `sample_rate`, `fs`, `dt` or `wf_increment`.
    """
    remarks: list[str] = []
    channels: list[MeasuredChannel] = []
    groups: dict[str, list[Column]] = {}
    single: list[str] = []
    with SafeHdf5(file, limit) as opened:
        for dataset in opened.datasets():
            values = opened.numbers(dataset)
            if values is None:
                continue
            path = printable(dataset.name).lstrip("/")
            if values.size < 2:
                single.append(path)
                continue
            unit = opened.attribute(dataset, "unit", "units", "unit_string", "einheit") or ""
            period = _period(opened, dataset) or _period(opened, dataset.parent)
            start = finite_number(opened.attribute(dataset, "t0", "start", "wf_start_offset")) or 0.0
            for column in columns_of(path, values, unit, remarks):
                if period and path != time:
                    times = even_times(column.values.size, period, start)
                    channels.append(MeasuredChannel(column.name, column.values, column.unit, times, "time"))
                else:
                    groups.setdefault(path.rpartition("/")[0], []).append(column)
        remarks += dict.fromkeys(opened.left_out)
    if single:
        remarks.append(f"Single numbers are no channels: {', '.join(single[:8])}.")
    check_count(len(channels) + sum(map(len, groups.values())), file)
    if time is not None:
        every = [column for columns in groups.values() for column in columns]
        return channels + with_abscissa(every, file, remarks, time=time, time_unit=time_unit, rate=rate), remarks
    for columns in groups.values():
        channels += with_abscissa(columns, file, remarks, time_unit=time_unit, rate=rate)
    return channels, remarks


def _period(opened: SafeHdf5, owner: Any) -> float | None:
    rate = finite_number(opened.attribute(owner, "sample_rate", "samplerate", "sampling_rate", "fs"))
    period = finite_number(opened.attribute(owner, "dt", "wf_increment", "sample_period"))
    period = 1 / rate if rate else period
    return period if period and period > 0 and np.isfinite(period) else None
