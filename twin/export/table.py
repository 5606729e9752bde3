"""Named columns of numbers as CSV or HDF5, by the ending of the file, whole or not at all."""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from twin._checks import InputError
from twin.io._whole_file import whole_file

_CSV, _HDF5 = (".csv", ".txt"), (".h5", ".hdf5")


@dataclass(frozen=True)
class Column:
    """One column of a table."""

    name: str
    """What it is called."""
    unit: str
    """Unit of the values, empty if not known."""
    values: np.ndarray
    """Values, shape (rows,)."""

    @property
    def heading(self) -> str:
        """Name and unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


def write_table(
    path: str | os.PathLike[str],
    columns: list[Column],
    *,
    delimiter: str = ",",
    sample_rate: float | None = None,
    endings: tuple[str, ...] = _CSV + _HDF5,
) -> Path:
    """Write columns.

    Args:
        path: a file ending in .csv or .txt (text, 17 digits, a heading "position [m]") or .h5 or .hdf5 (one dataset
            for each column, with the attributes `unit` and, where the rows are evenly spaced, `sample_rate` [Hz]).
        columns: the columns.
        delimiter: one character between the columns of a text file.
        sample_rate: rows per second [Hz], None where they are not evenly spaced.
        endings: endings that are taken.

    Returns:
        Path of the file.

    Raises:
        InputError: an unknown ending, a name given twice or with the delimiter in it, a folder that does not exist.
    """
    file = Path(path)
    ending = file.suffix.lower()
    if ending not in endings:
        raise InputError(f"{str(file)!r} has no ending that is known. Use one of {', '.join(endings)}.")
    names = [column.name for column in columns]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"Two columns are called {name!r}. Give them different names.")
    if ending in _HDF5:
        _write_hdf5(file, columns, sample_rate)
    else:
        _write_csv(file, columns, delimiter)
    return file


def _write_csv(file: Path, columns: list[Column], delimiter: str) -> None:
    if len(delimiter) != 1 or delimiter in '."\n\r-+e' or delimiter.isdigit():
        raise InputError(f'delimiter must be one character such as ",", ";" or a tab, but is {delimiter!r}.')
    for column in columns:
        if delimiter in column.heading or '"' in column.heading or not column.heading.isprintable():
            raise InputError(f"The heading {column.heading!r} holds the delimiter or a quote. Use another delimiter.")
    table = np.column_stack([column.values for column in columns])
    head = delimiter.join(column.heading for column in columns)
    with whole_file(file) as temporary, temporary.open("w", encoding="utf-8", newline="") as text:
        np.savetxt(text, table, fmt="%.17g", delimiter=delimiter, header=head, comments="")


def _write_hdf5(file: Path, columns: list[Column], sample_rate: float | None) -> None:
    import h5py  # a second to import

    for column in columns:
        if "/" in column.name or column.name in ("", "."):
            raise InputError(f"{column.name!r} cannot name an HDF5 dataset: '/' separates groups. Rename the channel.")
    with whole_file(file) as temporary, h5py.File(temporary, "w") as out:
        for column in columns:
            dataset = out.create_dataset(column.name, data=column.values)
            dataset.attrs["unit"] = column.unit
            if sample_rate is not None:
                dataset.attrs["sample_rate"] = sample_rate
