"""MAT-files of version 7.3, which are HDF5: structs are groups, cells are references, arrays are transposed."""

from pathlib import Path
from typing import Any

import numpy as np

from twin._checks import InputError
from twin.io.formats._hdf5_walk import SafeHdf5
from twin.io.formats._shared import printable

_DEEPEST, _MOST_PARTS = 24, 20_000


def hdf5_tree(file: Path, limit: int) -> dict[str, Any]:
    """The variables of a MAT-file of version 7.3 as `mat_tree` gives them.

    Args:
        file: the file.
        limit: bytes that may be read.

    Raises:
        InputError: a damaged file, or more than the limit.
    """
    with SafeHdf5(file, limit) as opened:
        return {
            name: _node(opened, member, 1) for name, member in opened.items(opened.file) if not name.startswith("#")
        }


def _node(opened: SafeHdf5, member: Any, depth: int) -> Any:
    import h5py

    if depth > _DEEPEST:
        raise InputError(f"{str(opened.path)!r} nests structs deeper than {_DEEPEST}. Check that it is sound.")
    if isinstance(member, h5py.Group):
        fields = {name: _node(opened, one, depth + 1) for name, one in opened.items(member)}
        return _rows(fields)
    kind = printable(opened.attribute(member, "matlab_class"))
    if opened.attribute(member, "matlab_empty"):
        return "" if kind == "char" else np.empty(0)
    if member.dtype.kind == "O":
        return _cells(opened, member, depth)
    values = opened.numbers(member)
    if values is None:
        return None
    values = values.T
    if kind == "char":
        return "".join(chr(int(code)) for code in values.ravel()[:65536] if 0 < code < 0x10FFFF)
    return values


def _cells(opened: SafeHdf5, member: Any, depth: int) -> Any:
    import h5py

    if h5py.check_ref_dtype(member.dtype) is not h5py.Reference or member.size > _MOST_PARTS:
        return None
    plan = member.id.get_create_plist()
    if member.is_virtual or plan.get_external_count():
        return None
    held = [opened.file[one] if one else None for one in member[()].T.ravel()]
    return _Cells(None if one is None else _node(opened, one, depth + 1) for one in held)


class _Cells(list):
    """Parts behind references; told from other lists because an array of structs is stored field by field."""


def _rows(fields: dict[str, Any]) -> Any:
    """An array of structs is stored as one list for each field: turned into a list of dictionaries."""
    lengths = {len(one) for one in fields.values() if isinstance(one, _Cells)}
    if len(lengths) == 1 and all(isinstance(one, _Cells) for one in fields.values()):
        return [{name: one[row] for name, one in fields.items()} for row in range(lengths.pop())]
    return fields
