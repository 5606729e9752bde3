"""TDMS of LabVIEW and DIAdem: channels of groups, their waveform properties and units."""

import contextlib
import logging
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from twin._checks import InputError
from twin.io.formats._abscissa import even_times, with_abscissa
from twin.io.formats._shared import Column, as_column, check_count, check_room, finite_number, printable
from twin.io.measurement import MeasuredChannel

ENDINGS = (".tdms",)
_UNITS = ("unit_string", "NI_UnitDescription", "unit", "Unit")
# No scaling makes more than this of one byte.
_GROWTH = 8


def matches(head: bytes) -> int:
    """Whether these first bytes are those of a TDMS file."""
    return 2 if head.startswith(b"TDSm") else 0


def read(
    file: Path,
    limit: int,
    *,
    time: str | None = None,
    time_unit: str | None = None,
    rate: float | None = None,
    incomplete: str = "refuse",
) -> tuple[list[MeasuredChannel], list[str]]:
    """Read the channels of numbers of all groups; one group's channels are called by their name alone.

    Args:
        file: the file; an index file beside it is not used.
        limit: bytes that may be read.
        time: name of the time channel; None takes the waveform's increment, or finds it in each group.
        time_unit: unit of the time channel; None takes the file's.
        rate: samples per second, where there is neither.
        incomplete: "keep" reads what is there of a recording that broke off; "refuse" does not.
    """
    if incomplete not in ("refuse", "keep"):
        raise InputError(f"incomplete must be refuse or keep, but is {incomplete!r}.")
    from nptdms import TdmsFile

    remarks: list[str] = []
    channels: list[MeasuredChannel] = []
    # Given open, so that no index file beside it is trusted.
    with file.open("rb") as opened, _quiet(remarks), TdmsFile.open(opened) as tdms:
        groups = tdms.groups()
        check_count(sum(len(group) for group in groups), file)
        for group in groups:
            columns: list[Column] = []
            for channel in group.channels():
                name = channel.name if len(groups) == 1 else f"{group.name}/{channel.name}"
                values = _values(channel, file, limit)
                if values is None:
                    remarks.append(f"Channel {printable(name)!r} holds no numbers and is left out.")
                    continue
                unit = next((channel.properties[key] for key in _UNITS if key in channel.properties), "")
                column = as_column(printable(name), values, unit)
                increment = finite_number(channel.properties.get("wf_increment"))
                if increment and increment > 0 and time is None:
                    start = finite_number(channel.properties.get("wf_start_offset")) or 0.0
                    times = even_times(values.size, increment, start)
                    channels.append(MeasuredChannel(column.name, column.values, column.unit, times, "time"))
                else:
                    columns.append(column)
            if time is None or any(column.name == time for column in columns) or len(groups) == 1:
                channels += with_abscissa(columns, file, remarks, time=time, time_unit=time_unit, rate=rate)
            else:
                channels += with_abscissa(columns, file, remarks, rate=rate)
    broken = [
        told for told in remarks if told.startswith("npTDMS") and re.search("less data|incomplete|Cropping", told)
    ]
    if broken and incomplete == "refuse":
        raise InputError(
            f"TDMS file {str(file)!r} is cut short ({broken[0]}) Copy it again, or read what there is by the option "
            "incomplete='keep'."
        )
    return channels, remarks


def _values(channel: Any, file: Path, limit: int) -> np.ndarray | None:
    count = len(channel)
    kind = np.dtype(channel.dtype)
    if kind.kind not in "biufcM":
        return None
    room = _GROWTH * file.stat().st_size
    if count > room:
        raise InputError(
            f"{str(file)!r} declares {count} samples of {printable(channel.name)!r}, more than it can hold. It is "
            "damaged or cut short; copy or export it again."
        )
    check_room(count * max(kind.itemsize, 8), limit, file, f"channel {printable(channel.name)!r}")
    values = np.asarray(channel[:])
    if values.dtype.kind == "M":
        return (values - values[:1]).astype("timedelta64[ns]").astype(np.float64) * 1e-9
    return values if values.dtype.kind in "biufc" and values.size else None


class _Keeper(logging.Handler):
    """Keeps what the library tells."""

    def __init__(self, told: list[str]):
        super().__init__(logging.WARNING)
        self.told = told

    def emit(self, record: logging.LogRecord) -> None:
        """Keep one message."""
        self.told.append(f"npTDMS: {printable(record.getMessage())}.")


@contextlib.contextmanager
def _quiet(remarks: list[str]) -> Iterator[None]:
    """What npTDMS logs becomes remarks while the file is read."""
    from nptdms.log import log_manager

    logger, before = logging.getLogger("nptdms"), log_manager.console_handler.level
    told: list[str] = []
    keeper = _Keeper(told)
    log_manager.console_handler.setLevel(logging.CRITICAL)
    logger.addHandler(keeper)
    propagated, logger.propagate = logger.propagate, False
    try:
        yield
    finally:
        logger.propagate = propagated
        logger.removeHandler(keeper)
        log_manager.console_handler.setLevel(before)
        remarks += dict.fromkeys(told[:8])
