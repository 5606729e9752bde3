"""NPZ and NPY of NumPy, without pickle."""

import io
import math
import zipfile
from pathlib import Path

import numpy as np

from twin._checks import InputError
from twin.io.formats._abscissa import with_abscissa
from twin.io.formats._shared import Column, check_count, check_room, columns_of, printable
from twin.io.measurement import MeasuredChannel

ENDINGS = (".npz", ".npy")
_HEADER = 20_000
_MOST_MEMBERS = 10_000


def matches(head: bytes) -> int:
    """Whether these first bytes are those of an NPZ or NPY file."""
    if head.startswith(b"\x93NUMPY"):
        return 2
    return 2 if head.startswith(b"PK\x03\x04") and b".npy" in head[:400] else 0


def read(
    file: Path, limit: int, *, time: str | None = None, time_unit: str | None = None, rate: float | None = None
) -> tuple[list[MeasuredChannel], list[str]]:
    """Read the arrays; those of objects are refused, as to read them would run code.

    Args:
        file: the file.
        limit: bytes that may be unpacked.
        time: name of the time among the arrays; None finds it.
        time_unit: unit of the time; None takes seconds.
        rate: samples per second; None takes an array "fs", "rate" or "dt" of one number, if there is one.
    """
    remarks: list[str] = []
    columns: list[Column] = []
    for name, array in _arrays(file, limit, remarks):
        columns += columns_of(name, array, "", remarks)
    check_count(len(columns), file)
    single = {column.name.lower(): float(column.values[0].real) for column in columns if column.values.size == 1}
    for name in ("fs", "rate", "sample_rate"):
        rate = rate or (single.get(name) if single.get(name, 0) > 0 else None)
    if rate is None and single.get("dt", 0) > 0:
        rate = 1 / single["dt"]
    columns = [column for column in columns if column.values.size > 1]
    return with_abscissa(columns, file, remarks, time=time, time_unit=time_unit, rate=rate), remarks


def _arrays(file: Path, limit: int, remarks: list[str]):
    with file.open("rb") as opened:
        if opened.read(6) == b"\x93NUMPY":
            opened.seek(0)
            size = file.stat().st_size
            if _sound(opened, size, size, limit, file, file.stem, remarks):
                opened.seek(0)
                yield file.stem, np.load(opened, allow_pickle=False)
            return
    with zipfile.ZipFile(file) as archive:
        members = archive.infolist()
        if len(members) > _MOST_MEMBERS:
            raise InputError(f"{str(file)!r} has {len(members)} members. Check that it holds a measurement.")
        used = 0
        for member in members:
            name = printable(member.filename).removesuffix(".npy")
            if not member.filename.endswith(".npy"):
                remarks.append(f"{name!r} is no array and is left out.")
                continue
            used += member.file_size
            check_room(used, limit, file, "unpacked arrays")
            with archive.open(member) as opened:
                head = io.BytesIO(opened.read(min(_HEADER, member.file_size)))
            if _sound(head, member.file_size, member.file_size, limit, file, name, remarks):
                with archive.open(member) as opened:
                    yield name, np.lib.format.read_array(opened, allow_pickle=False)


def _sound(head, size: int, most: int, limit: int, file: Path, name: str, remarks: list[str]) -> bool:
    """Whether an array may be read: one of numbers, all there, within the limit."""
    version = np.lib.format.read_magic(head)
    reader = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, kind = reader(head)
    if kind.hasobject:
        raise InputError(
            f"{str(file)!r} holds Python objects in {name!r}, which only unpickling could read; that could run any "
            "code. Save plain arrays of numbers."
        )
    needed = math.prod(shape) * kind.itemsize
    if min(shape, default=0) < 0 or needed + head.tell() > most or needed + head.tell() != size:
        raise InputError(
            f"{str(file)!r} declares {math.prod(shape)} numbers in {name!r}, which its {size} bytes do not hold. It is "
            "damaged; copy or save it again."
        )
    check_room(math.prod(shape) * max(8, kind.itemsize), limit, file, f"array {name!r}")
    if kind.kind not in "biufc" or kind.names is not None:
        remarks.append(f"{name!r} holds no numbers and is left out.")
        return False
    return True
