"""Simulated and measured motions as files for other tools."""

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from twin._checks import InputError
from twin.export.names import quantities
from twin.export.table import Column, write_table
from twin.io.units import to_si
from twin.record import Record
from twin.trajectory import SimulationStatus, Trajectory

# Relative jitter of the sample period below which a rate is written.
_EVEN = 1e-6


def write_trajectory(
    path: str | os.PathLike[str],
    trajectory: Trajectory | Record,
    *,
    units: Mapping[str, str] | None = None,
    states: bool = False,
    delimiter: str = ",",
) -> Path:
    """Write a trajectory or a record as CSV or HDF5, whole or not at all.

    Args:
        path: a file ending in .csv or .txt (17 digits, headings such as "position [m]") or .h5 or .hdf5 (one dataset
            for each channel, with the attributes `unit` and `sample_rate` [Hz]); one that exists is replaced.
        trajectory: what was simulated or measured.
        units: units wanted by channel, such as `{"position": "mm"}`; the values are converted. For a channel whose
            SI unit is not known, as the position of an axis that may be linear or rotary, it also says what it is.
        states: write the states of a trajectory as well, as "state.NAME".
        delimiter: one character between the columns of a text file.

    Returns:
        Path of the file.

    Raises:
        InputError: a run that failed, an unknown ending, a unit for a channel that is not there or of another
            dimension, two channels of one name, a folder that does not exist.
    """
    columns = _of_record(trajectory) if isinstance(trajectory, Record) else _of_trajectory(trajectory, states)
    wanted = units or {}
    known = {column.name for column in columns}
    for name in wanted:
        if name not in known:
            raise InputError(
                f"units names {name!r}, but there is no such channel. There are {', '.join(sorted(known))}."
            )
    columns = [_converted(column, wanted[column.name]) if column.name in wanted else column for column in columns]
    return write_table(path, columns, delimiter=delimiter, sample_rate=_rate(np.asarray(trajectory.times)))


def _of_record(record: Record) -> list[Column]:
    channels = [Column(name, record.units[name], np.asarray(values)) for name, values in record.channels.items()]
    return [Column("time", "s", np.asarray(record.times)), *channels]


def _of_trajectory(trajectory: Trajectory, states: bool) -> list[Column]:
    good = (SimulationStatus.successful, SimulationStatus.not_accurate)
    if not any(bool(trajectory.status == status) for status in good):
        raise InputError(
            f"The run failed, its trajectory holds no numbers: {SimulationStatus[trajectory.status]} Simulate again."
        )
    columns = [Column("time", "s", np.asarray(trajectory.times))]
    columns += _columns(trajectory.outputs, "")
    return columns + (_columns(trajectory.states, "state.") if states else [])


def _columns(structure: object, prefix: str) -> list[Column]:
    import jax

    first = jax.tree.map(lambda rows: rows[0], structure)
    rows = [np.asarray(leaf).reshape(np.shape(leaf)[0], -1) for leaf in jax.tree.leaves(structure)]
    values = np.concatenate(rows, axis=1).T if rows else []
    return [
        Column(prefix + one.name, one.unit, column)
        for one, column in zip(quantities(first, alone="state"), values, strict=True)
    ]


def _converted(column: Column, unit: str) -> Column:
    label = f"channel {column.name!r}"
    known = column.unit if column.unit not in ("", "1") else None
    zero, one = to_si([0.0, 1.0], unit, known, name=label)
    if zero != 0.0:
        raise InputError(
            f"{label} cannot be written in {unit!r}, whose zero lies elsewhere. Use a unit without offset."
        )
    return Column(column.name, unit, column.values / one)


def _rate(times: np.ndarray) -> float | None:
    steps = np.diff(times)
    period = (times[-1] - times[0]) / steps.size
    return float(1 / period) if np.all(np.abs(steps - period) <= _EVEN * period) else None
