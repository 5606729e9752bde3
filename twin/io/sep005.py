"""Time series as dictionaries by SEP 005 of SDyPy, the exchange form of structural dynamics in Python.

One dictionary a channel, with "data", "name", "unit_str" and "time" [s] or "fs" [Hz]; further keys are allowed
(SDyPy Enhancement Proposal 5, "Unified time series", github.com/sdypy/sdypy).
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from twin._checks import InputError
from twin._sample_rate import uniform_rate
from twin.io.formats._abscissa import even_times
from twin.io.measurement import MeasuredChannel, Measurement
from twin.record import Record


def from_sep005(series: Mapping[str, Any] | Sequence[Mapping[str, Any]], *, name: str = "SEP 005") -> Measurement:
    """A measurement of SEP 005 time series.

    Args:
        series: one dictionary, or one for each channel.
        name: what to call the measurement.

    Returns:
        The channels with their times.

    Raises:
        InputError: a key that is missing, data that is no vector of numbers, or times of another length.
    """
    given = [series] if isinstance(series, Mapping) else list(series)
    return Measurement(name, name, tuple(_channel(one, number) for number, one in enumerate(given)), (), "sep005")


def to_sep005(record: Record) -> list[dict[str, Any]]:
    """SEP 005 time series of a record.

    Args:
        record: the record; even sampling gives "fs", uneven "time".

    Returns:
        One dictionary a channel, in SI units.
    """
    times = np.asarray(record.times)
    try:
        axis: dict[str, Any] = {"fs": uniform_rate(record)}
    except InputError:
        axis = {"time": times}
    return [
        {"name": name, "data": np.asarray(values), "unit_str": record.units[name], "group": record.name, **axis}
        for name, values in record.channels.items()
    ]


def _channel(one: Mapping[str, Any], number: int) -> MeasuredChannel:
    for key in ("data", "name", "unit_str"):
        if key not in one:
            raise InputError(f"series {number} has no {key!r}, but SEP 005 asks for it. Add it.")
    name = str(one["name"])
    try:
        data = np.asarray(one["data"], dtype=np.float64)
        times = None if one.get("time") is None else np.asarray(one["time"], dtype=np.float64)
        rate = None if one.get("fs") is None else float(one["fs"])
    except (TypeError, ValueError) as error:
        raise InputError(f"series {name!r} holds something that is no number: {error}. Give numbers.") from error
    if data.ndim != 1 or (times is not None and times.shape != data.shape):
        shape = None if times is None else times.shape
        raise InputError(f"series {name!r} has shapes {data.shape} of data and {shape} of time. Give equal vectors.")
    if times is None and (rate is None or not rate > 0 or not np.isfinite(rate)):
        raise InputError(f"series {name!r} has neither 'time' nor a positive 'fs'. Give one of them.")
    if times is None:
        assert rate is not None
        times = even_times(data.size, 1 / rate)
    return MeasuredChannel(name, data, str(one["unit_str"]), times, "time")
