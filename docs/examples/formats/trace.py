"""TRACE files of a made-up controller: a line of text with the rate, then 32-bit floats."""

from pathlib import Path

import numpy as np

from twin._checks import InputError
from twin.io.formats._abscissa import even_times
from twin.io.formats._shared import check_room
from twin.io.measurement import MeasuredChannel

ENDINGS = (".trace",)


def matches(head: bytes) -> int:
    """Whether these first bytes are those of a TRACE file: 2 is certain."""
    return 2 if head.startswith(b"TRACE ") else 0


def read(file: Path, limit: int, *, unit: str = "A") -> tuple[list[MeasuredChannel], list[str]]:
    """Read the one channel.

    Args:
        file: the file.
        limit: bytes that may be read.
        unit: unit of the samples.

    Raises:
        InputError: a head without a rate, or a file that is cut.
    """
    check_room(2 * file.stat().st_size, limit, file, "samples")
    head, _, body = file.read_bytes().partition(b"\n")
    rate = head.removeprefix(b"TRACE ").strip()
    if not rate.isdigit() or int(rate) == 0 or len(body) % 4:
        raise InputError(f"{str(file)!r} has no rate in its first line, or is cut. Export it again.")
    values = np.frombuffer(body, dtype="<f4").astype(np.float64)
    times = even_times(values.size, 1 / int(rate))
    return [MeasuredChannel("trace", values, unit, times, "time")], [f"The rate is {int(rate)} Hz."]
