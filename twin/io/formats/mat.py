"""MAT-files of all versions: plain vectors, structs, and the layouts of Simulink and of recorders."""

import struct
from pathlib import Path
from typing import Any

import numpy as np

from twin.io.formats._abscissa import even_times, with_abscissa
from twin.io.formats._mat_tree import mat_tree
from twin.io.formats._shared import Column, as_column, check_count, columns_of, printable
from twin.io.measurement import MeasuredChannel

ENDINGS = (".mat",)
_TIMES = ("time", "t", "Time")


def matches(head: bytes) -> int:
    """Whether these first bytes are those of a MAT-file."""
    if head.startswith((b"MATLAB 5.0", b"MATLAB 7")) or head[126:128] in (b"IM", b"MI"):
        return 2
    if len(head) < 20:
        return 0
    for order in "<>":
        kind, rows, columns, imaginary, length = struct.unpack_from(f"{order}5i", head)
        sizes_fit = rows >= 0 and columns >= 0 and imaginary in (0, 1) and 0 < length <= 128
        if 0 <= kind <= 4052 and kind % 10 <= 2 and kind // 10 % 10 <= 5 and sizes_fit:
            return 1
    return 0


def read(
    file: Path, limit: int, *, time: str | None = None, time_unit: str | None = None, rate: float | None = None
) -> tuple[list[MeasuredChannel], list[str]]:
    """Read a MAT-file.

    Vectors are channels under their name, the columns of a matrix "name(1)", "name(2)", the fields of structs
    "struct.field". Known layouts keep their own times: structures with time and timeseries of Simulink (time,
    signals), and recordings with X and Y (Name, Data, Unit).

    Args:
        file: the file.
        limit: bytes that may be read.
        time: name of the time among these; None finds it.
        time_unit: unit of the time; None takes seconds.
        rate: samples per second, where there is no time.
    """
    remarks: list[str] = []
    channels: list[MeasuredChannel] = []
    columns: list[Column] = []
    for name, value in mat_tree(file, limit).items():
        _gather(name, value, channels, columns, remarks)
    check_count(len(columns) + len(channels), file)
    longest = max((column.values.size for column in columns), default=0)
    if channels or longest > 1:
        single = [column for column in columns if column.values.size <= 1]
        if single:
            told = ", ".join(f"{column.name} = {column.values[0]:g}" for column in single[:8] if column.values.size)
            remarks.append(f"Single numbers are no channels: {told}.")
        columns = [column for column in columns if column.values.size > 1]
        rate = rate or _rate_among(single, remarks)
    if columns and (time is not None or not channels or not any(channel.name == time for channel in channels)):
        channels += with_abscissa(columns, file, remarks, time=time, time_unit=time_unit, rate=rate)
    return channels, remarks


def _gather(name: str, value: Any, channels: list[MeasuredChannel], columns: list[Column], remarks: list[str]) -> None:
    if isinstance(value, np.ndarray):
        columns += _vectors(name, value, remarks)
    elif isinstance(value, dict):
        known = _recorder(value) or _simulink(name, value)
        if known:
            remarks.append(f"{name!r} is a recording with times of its own.")
            channels += known
            return
        for field, one in value.items():
            _gather(f"{name}.{field}", one, channels, columns, remarks)
    elif isinstance(value, list):
        for number, one in enumerate(value, start=1):
            if not isinstance(one, str):
                _gather(f"{name}({number})", one, channels, columns, remarks)


def _vectors(name: str, value: np.ndarray, remarks: list[str]) -> list[Column]:
    return columns_of(name, value, "", remarks, "{}({})", 1) if value.size else []


def _rate_among(single: list[Column], remarks: list[str]) -> float | None:
    for column in single:
        own = column.name.lower().rsplit(".", 1)[-1]
        value = float(np.real(column.values[0])) if column.values.size else 0.0
        if own in ("fs", "sample_rate", "samplerate", "rate", "fsample") and value > 0:
            remarks.append(f"The sample rate is that of {column.name!r}.")
            return value
        if own in ("dt", "ts", "tsample", "sample_time") and value > 0:
            remarks.append(f"The sample period is that of {column.name!r}.")
            return 1 / value
    return None


def _vector(value: Any) -> np.ndarray | None:
    if isinstance(value, list) and len(value) == 1:
        value = value[0]
    return value.ravel() if isinstance(value, np.ndarray) and value.size > 1 and value.dtype.kind != "c" else None


def _recorder(value: dict[str, Any]) -> list[MeasuredChannel]:
    """A recording with X and Y, each an array of structs with Name, Data and Unit, as dSPACE writes it."""
    if not {"X", "Y"} <= set(value):
        return []
    axes, signals = ([one] if isinstance(one, dict) else one for one in (value["X"], value["Y"]))
    if not all(isinstance(one, list) and all(isinstance(row, dict) for row in one) for one in (axes, signals)):
        return []
    times = [_vector(axis.get("Data")) for axis in axes]
    channels = []
    for signal in signals:
        data = signal.get("Data")
        if not isinstance(data, np.ndarray) or data.size < 2:
            continue
        index = signal.get("XIndex")
        chosen = int(index.ravel()[0]) - 1 if isinstance(index, np.ndarray) and index.size == 1 else 0
        own = times[chosen] if 0 <= chosen < len(times) else None
        column = as_column(printable(signal.get("Name")) or f"Y({len(channels) + 1})", data, signal.get("Unit", ""))
        channels.append(_channel(column, own))
    return channels


def _simulink(name: str, value: dict[str, Any]) -> list[MeasuredChannel]:
    """A structure with time (time, signals.values, signals.label), or a timeseries saved as a struct (Time, Data)."""
    times = next((one for one in map(_vector, (value.get(key) for key in _TIMES)) if one is not None), None)
    if "signals" in value:
        signals = [value["signals"]] if isinstance(value["signals"], dict) else value["signals"]
        if not isinstance(signals, list):
            return []
        found = [
            (printable(signal.get("label")) or f"{name}.signals({number})", signal.get("values"), signal.get("unit"))
            for number, signal in enumerate(signals, start=1)
            if isinstance(signal, dict)
        ]
    elif times is not None and {"Data", "data"} & set(value) and set(map(str.lower, value)) >= {"time", "data"}:
        found = [(name, value.get("Data", value.get("data")), value.get("Unit", value.get("unit")))]
    else:
        return []
    channels = []
    for label, values, unit in found:
        if isinstance(values, np.ndarray) and values.size > 1:
            for column in _vectors(label, np.squeeze(values), []):
                channels.append(_channel(as_column(column.name, column.values, unit or column.unit), times))
    return channels


def _channel(column: Column, times: np.ndarray | None) -> MeasuredChannel:
    if times is None:
        return MeasuredChannel(column.name, column.values, column.unit)
    if times.size == 2 and column.values.size > 2 and times[1] > times[0]:  # only the ends of an even axis are kept
        times = even_times(column.values.size, (times[1] - times[0]) / (column.values.size - 1), float(times[0]))
    if times.size != column.values.size:
        return MeasuredChannel(column.name, column.values, column.unit)
    return MeasuredChannel(column.name, column.values, column.unit, times.astype(np.float64), "time")
