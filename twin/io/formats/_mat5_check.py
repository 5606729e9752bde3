"""A MAT-file of version 4 to 7 is walked before SciPy reads it: every declared size must be covered by bytes.

SciPy trusts what a file declares: a few bytes can ask for gigabytes, or nest so deep that the process dies. Here each
element's size is compared with the bytes that are there, and compressed ones are unpacked only up to the limit.
Format: MATLAB "MAT-File Format" (MathWorks), chapters 1 and 2.
"""

import math
import struct
import zlib
from pathlib import Path
from typing import NamedTuple

from twin._checks import InputError
from twin.io.formats._shared import check_room

_BYTES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
_MATRIX, _COMPRESSED = 14, 15
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE = 1, 2, 3, 4, 5
_NUMBERS = range(6, 16)
_DEEPEST, _MOST_NODES = 24, 100_000
_HEADER = 128


class _Element(NamedTuple):
    kind: int
    data: memoryview
    end: int


def sound_variables(file: Path, limit: int) -> list[str]:
    """Names of the variables of numbers, texts, structs and cells; others are left out.

    Args:
        file: a MAT-file of version 4 to 7.
        limit: bytes that may be unpacked.

    Raises:
        InputError: sizes that the file does not hold, too deep nesting, or more than the limit.
    """
    check_room(file.stat().st_size, limit, file, "the file itself")
    content = memoryview(file.read_bytes())
    if len(content) >= _HEADER and bytes(content[126:128]) in (b"IM", b"MI") and 0 not in bytes(content[:4]):
        return _Walk(file, limit, "<" if content[126:128] == b"IM" else ">").variables(content)
    return _version_4(file, content)


class _Walk:
    """One pass through a file of version 5 to 7."""

    def __init__(self, file: Path, limit: int, order: str):
        self.file = file
        self.limit = limit
        self.order = order
        self.used = 0
        self.nodes = 0

    def variables(self, content: memoryview) -> list[str]:
        """Names of the variables that may be read."""
        names, start = [], _HEADER
        while len(content) - start >= 8:
            element = self.element(content, start, padded=False)
            start = element.end
            if element.kind == _COMPRESSED:
                unpacked = zlib.decompressobj().decompress(element.data, self.limit - self.used + 1)
                self.used += len(unpacked)
                check_room(self.used, self.limit, self.file, "unpacked variables")
                element = self.element(memoryview(unpacked), 0, padded=False)
            if element.kind == _MATRIX and (name := self.matrix(element.data, 1)) and not name.startswith("__"):
                names.append(name)
        return names

    def element(self, data: memoryview, start: int, *, padded: bool = True) -> _Element:
        """The element that begins at a byte."""
        if len(data) - start < 8:
            raise self.fault("an element is cut short")
        kind, size = struct.unpack_from(f"{self.order}II", data, start)
        if kind >> 16:  # a small element: size and kind share the first word, its data the second
            kind, size, first = kind & 0xFFFF, kind >> 16, start + 4
            if size > 4:
                raise self.fault("a small element declares more than 4 bytes")
            return _Element(kind, data[first : first + size], start + 8)
        first = start + 8
        if size > len(data) - first:
            raise self.fault(f"an element declares {size} bytes where {len(data) - first} are left")
        end = first + size + (-size % 8 if padded else 0)
        return _Element(kind, data[first : first + size], end)

    def matrix(self, data: memoryview, depth: int) -> str | None:
        """Name of a matrix that is sound; None where it is of a kind that is left out."""
        self.nodes += 1
        if depth > _DEEPEST or self.nodes > _MOST_NODES:
            raise self.fault(f"it nests deeper than {_DEEPEST} or has more than {_MOST_NODES} parts")
        if len(data) == 0:
            return ""
        flags = self.element(data, 0)
        if len(flags.data) != 8:
            raise self.fault("a matrix has damaged flags")
        word = struct.unpack_from(f"{self.order}I", flags.data)[0]
        kind, is_complex = word & 0xFF, bool(word & 0x800)
        if kind not in (_CELL, _STRUCT, _CHAR, *_NUMBERS):
            return None
        shape = self.element(data, flags.end)
        if len(shape.data) % 4 or not 8 <= len(shape.data) <= 128 or shape.kind != 5:
            raise self.fault("a matrix has damaged dimensions")
        dimensions = struct.unpack(f"{self.order}{len(shape.data) // 4}i", shape.data)
        if min(dimensions) < 0:
            raise self.fault("a matrix has a negative dimension")
        count = math.prod(dimensions)
        label = self.element(data, shape.end)
        name = bytes(label.data).decode("latin-1")
        if kind in (_CELL, _STRUCT):
            sound = self.parts(data, label.end, kind, count, depth)
        else:
            sound = self.numbers(data, label.end, count, is_complex, kind)
        return name if sound else None

    def parts(self, data: memoryview, start: int, kind: int, count: int, depth: int) -> bool:
        """Cells or fields of a matrix."""
        if kind == _STRUCT:
            length = self.element(data, start)
            names = self.element(data, length.end)
            one = struct.unpack(f"{self.order}i", length.data)[0] if len(length.data) == 4 else 0
            if one <= 0 or len(names.data) % one:
                raise self.fault("a struct has damaged field names")
            count *= len(names.data) // one
            start = names.end
        if count * 8 > len(data) - start:
            raise self.fault(f"a cell or struct declares {count} parts where {len(data) - start} bytes are left")
        sound = True
        for _ in range(count):
            element = self.element(data, start)
            if element.kind != _MATRIX:
                raise self.fault("a cell or struct holds something else than matrices")
            sound = self.matrix(element.data, depth + 1) is not None and sound
            start = element.end
        return sound

    def numbers(self, data: memoryview, start: int, count: int, is_complex: bool, kind: int) -> bool:
        """Numbers or characters of a matrix."""
        if kind == _CHAR and count == 0 and start >= len(data):
            return True
        for _ in range(2 if is_complex else 1):
            element = self.element(data, start)
            size = _BYTES.get(element.kind)
            if size is None or len(element.data) % size:
                raise self.fault("a matrix holds numbers of unknown type")
            # Characters in UTF-8 may take more bytes than there are; fewer are never right.
            held = len(element.data) // size
            if held != count and not (kind == _CHAR and held > count):
                raise self.fault(f"a matrix declares {count} numbers and holds {held}")
            self.used += 16 * count
            check_room(self.used // 2, self.limit, self.file, "matrices")
            start = element.end
        return True

    def fault(self, what: str) -> InputError:
        return _fault(self.file, what)


def _version_4(file: Path, content: memoryview) -> list[str]:
    names, start = [], 0
    while start < len(content):
        if len(content) - start < 20:
            raise _fault(file, "a header is cut short")
        order = "<" if 0 <= struct.unpack_from("<i", content, start)[0] <= 5000 else ">"
        kind, rows, columns, imaginary, length = struct.unpack_from(f"{order}5i", content, start)
        size = {0: 8, 1: 4, 2: 4, 3: 2, 4: 2, 5: 1}.get(kind // 10 % 10)
        if not 0 <= kind <= 5000 or size is None or kind % 10 > 2 or min(rows, columns) < 0 or imaginary not in (0, 1):
            raise _fault(file, "it is no MAT-file, or its headers are damaged")
        if not 0 < length <= 128:
            raise _fault(file, "a variable has no sound name")
        first = start + 20 + length
        name = bytes(content[start + 20 : first]).split(b"\0")[0].decode("latin-1")
        start = first + rows * columns * size * (1 + imaginary)
        if start > len(content):
            raise _fault(file, f"variable {name!r} declares {rows} x {columns} numbers, more than the file holds")
        if kind % 10 != 2:  # sparse matrices are left out
            names.append(name)
    return names


def _fault(file: Path, what: str) -> InputError:
    return InputError(
        f"MAT-file {str(file)!r} cannot be read: {what}. It is truncated, damaged or no MAT-file. Copy or export it "
        "again and compare its size with the original."
    )
