"""A MAT-file as a tree of plain things: dictionaries for structs, lists for cells, arrays and texts."""

from pathlib import Path
from typing import Any

import numpy as np

from twin._checks import InputError
from twin.io.formats._mat5_check import sound_variables

HDF5_MARK = b"\x89HDF\r\n\x1a\n"


def mat_tree(file: Path, limit: int) -> dict[str, Any]:
    """The variables of a MAT-file of any version, by name.

    Args:
        file: the file.
        limit: bytes that may be read.

    Returns:
        A struct as a dictionary, an array of structs and a cell array as lists, characters as text, numbers as arrays
        of their shape; objects, function handles and sparse matrices are left out.

    Raises:
        InputError: a damaged file, or more than the limit.
    """
    try:
        return _hdf5(file, limit) if is_hdf5(file) else _older(file, limit)
    except InputError:
        raise
    except Exception as error:  # a damaged file makes SciPy raise nearly anything: zlib, struct, type and value errors
        raise InputError(
            f"MAT-file {str(file)!r} cannot be read ({type(error).__name__}: {error}): it is truncated, damaged or "
            "no MAT-file. Copy or export it again and compare its size with the original."
        ) from error


def _hdf5(file: Path, limit: int) -> dict[str, Any]:
    from twin.io.formats._mat_hdf5 import hdf5_tree

    return hdf5_tree(file, limit)


def _older(file: Path, limit: int) -> dict[str, Any]:
    import scipy.io  # a quarter of a second to import

    names = sound_variables(file, limit)
    variables = scipy.io.loadmat(file, appendmat=False, variable_names=names, verify_compressed_data_integrity=True)
    return {name: _plain(variables[name]) for name in names if name in variables}


def is_hdf5(file: Path) -> bool:
    """Whether a MAT-file is of version 7.3, which is HDF5 behind a block of its own.

    Args:
        file: the file.
    """
    with file.open("rb") as opened:
        head = opened.read(520)
    return head.startswith(HDF5_MARK) or head[512:520] == HDF5_MARK


def _plain(value: Any) -> Any:
    if not isinstance(value, np.ndarray):
        return None
    if value.dtype.names is not None:
        rows = [{name: _plain(row[name]) for name in value.dtype.names} for row in value.ravel(order="F")]
        return rows[0] if len(rows) == 1 else rows
    if value.dtype.kind == "O":
        return [_plain(one) for one in value.ravel(order="F")]
    if value.dtype.kind in "US":
        return "".join(map(str, value.ravel())) if value.size <= 1 else [str(one) for one in value.ravel()]
    return value if value.dtype.kind in "biufc" else None
