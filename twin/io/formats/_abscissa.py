"""Which of a file's columns is the time, or the frequency."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from twin._checks import InputError
from twin.io.formats._shared import Column, is_called
from twin.io.measurement import MeasuredChannel, listed
from twin.io.units import to_si

_TIMES = ("time", "t", "zeit", "times", "timestamp", "zeitstempel", "time stamp", "tout", "zeitachse", "x-achse", "sec")
_FREQUENCIES = ("frequency", "freq", "f", "frequenz", "frequencies", "freqs")
_EVEN, _NEAR = 1e-3, 1e-2


def with_abscissa(
    columns: Sequence[Column],
    file: Path,
    remarks: list[str],
    *,
    time: str | None = None,
    time_unit: str | None = None,
    rate: float | None = None,
    first_may_be_time: bool = False,
) -> list[MeasuredChannel]:
    """Channels over the time, or frequency, that is among the columns.

    Args:
        columns: all columns.
        file: the file, for messages.
        remarks: what is assumed is added here.
        time: name of the time column; None looks for it by name, then by unit.
        time_unit: unit of the time column; None takes the file's, and seconds where it has none.
        rate: samples per second where there is no time column.
        first_may_be_time: whether a first column of even steps may be the time, whatever its name.

    Returns:
        The other columns. Those of another length than the time are counted only.

    Raises:
        InputError: if there is no column of that name, or the time has a unit of something else.
    """
    if rate is not None and not (np.isfinite(rate) and rate > 0):
        raise InputError(f"rate must be positive [Hz], but is {rate}. Give the samples per second of {str(file)!r}.")
    found, kind = _find(columns, time, file, first_may_be_time, remarks)
    if found is None:
        return _counted(columns, rate, remarks)
    axis = _axis(found, kind, time_unit, file, remarks)
    if rate is not None and kind == "time" and time_unit is None and not found.unit:
        axis = _suited(axis, rate, found.name, remarks)
    channels = []
    for column in columns:
        if column is found:
            continue
        if column.values.size == axis.size:
            channels.append(MeasuredChannel(column.name, column.values, column.unit, axis, kind))
        else:
            remarks.append(f"{column.name!r} has another length than {found.name!r}; its samples are only counted.")
            channels.append(MeasuredChannel(column.name, column.values, column.unit))
    return channels


def even_times(samples: int, step: float, start: float = 0.0) -> np.ndarray:
    """Times of even samples [s].

    Args:
        samples: how many.
        step: sample period [s].
        start: time of the first [s].
    """
    return start + step * np.arange(samples, dtype=np.float64)


def _counted(columns: Sequence[Column], rate: float | None, remarks: list[str]) -> list[MeasuredChannel]:
    if rate is None:
        if columns:
            remarks.append("There is no time column; samples are only counted. Name the time column, or give the rate.")
        return [MeasuredChannel(column.name, column.values, column.unit) for column in columns]
    remarks.append(f"There is no time column; the times follow from a sample rate of {rate:g} Hz.")
    return [
        MeasuredChannel(column.name, column.values, column.unit, even_times(column.values.size, 1 / rate), "time")
        for column in columns
    ]


def _find(
    columns: Sequence[Column], time: str | None, file: Path, first_may_be_time: bool, remarks: list[str]
) -> tuple[Column | None, str]:
    real = [column for column in columns if column.values.dtype.kind == "f"]
    if time is not None:
        for column in real:
            if is_called(time, column.name, column.unit):
                return column, "frequency" if _of_dimension(column.unit, "Hz") else "time"
        names = tuple(column.name for column in real)
        raise InputError(f"{str(file)!r} has no time column {time!r}; it has {listed(time, names)}. Correct the name.")
    for names, unit, kind in ((_TIMES, "s", "time"), (_FREQUENCIES, "Hz", "frequency")):
        for name in names:
            for column in real:
                own = column.name.lower().rsplit(".", 1)[-1].rsplit("/", 1)[-1]
                if own == name and len(columns) > 1 and (not column.unit or _of_dimension(column.unit, unit)):
                    if kind == "frequency" and not _increasing(column.values):
                        continue  # "f" may be a force
                    remarks.append(f"Column {column.name!r} is taken for the {kind}.")
                    return column, kind
        for column in real:
            if len(columns) > 1 and _of_dimension(column.unit, unit) and _increasing(column.values):
                remarks.append(f"Column {column.name!r} is taken for the {kind}, for its unit {column.unit!r}.")
                return column, kind
    if first_may_be_time and len(columns) > 1 and real and real[0] is columns[0] and _even(real[0].values):
        remarks.append(f"The first column, {real[0].name!r}, has even steps and is taken for the time.")
        return real[0], "time"
    return None, "index"


def _axis(found: Column, kind: str, time_unit: str | None, file: Path, remarks: list[str]) -> np.ndarray:
    basic = "Hz" if kind == "frequency" else "s"
    unit = time_unit or found.unit
    if not unit:
        remarks.append(f"{found.name!r} states no unit; {basic} is assumed.")
        return found.values
    if unit == basic:
        return found.values
    return to_si(found.values, unit, basic, name=f"{kind} column {found.name!r} of {str(file)!r}")


def _suited(axis: np.ndarray, rate: float, name: str, remarks: list[str]) -> np.ndarray:
    """Times without unit in s, where their steps suit the sample rate in ms, µs or ns only."""
    step = float(np.median(np.diff(axis))) if axis.size > 1 else 0.0
    for unit, factor in (("ms", 1e3), ("µs", 1e6), ("ns", 1e9)):
        if abs(step * rate / factor - 1) < _NEAR:
            remarks.append(
                f"The steps of {name!r} suit the sample rate of {rate:g} Hz only in {unit}, so it is in {unit}."
            )
            return axis / factor
    return axis


def _of_dimension(unit: str, basic: str) -> bool:
    if not unit:
        return False
    if unit == basic:
        return True
    try:
        to_si(1.0, unit, basic)
    except InputError:
        return False
    return True


def _increasing(values: np.ndarray) -> bool:
    return values.size > 2 and bool(np.all(np.diff(values) > 0))


def _even(values: np.ndarray) -> bool:
    if not _increasing(values):
        return False
    steps = np.diff(values)
    return bool(np.max(np.abs(steps - steps.mean())) <= max(_EVEN * steps.mean(), 1e-9 * np.abs(values).max()))
