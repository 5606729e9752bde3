"""Frequency responses as text."""

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from twin.export.table import Column, write_table
from twin.frf import FRF


def write_frf_csv(
    path: str | os.PathLike[str],
    frf: FRF,
    *,
    units: Mapping[tuple[str, str], str] | None = None,
    delimiter: str = ",",
) -> Path:
    """Write a frequency response as CSV, whole or not at all.

    The columns are the frequency [Hz] and, for each response, its real and its imaginary part with 17 digits, headed
    "real position/command [m/N]". Where the variance is known, it follows as "variance ...", in the squared unit.

    Args:
        path: a file ending in .csv or .txt; one that exists is replaced.
        frf: the response.
        units: unit by (output, input), for the headings.
        delimiter: one character between the columns.

    Returns:
        Path of the file.

    Raises:
        InputError: an unknown ending, a name that holds the delimiter, a folder that does not exist.
    """
    columns = [Column("frequency", "Hz", np.asarray(frf.frequency))]
    for i, output in enumerate(frf.outputs):
        for j, excitation in enumerate(frf.inputs):
            unit, name, values = (units or {}).get((output, excitation), ""), f"{output}/{excitation}", frf.values[i, j]
            columns.append(Column(f"real {name}", unit, np.real(np.asarray(values))))
            columns.append(Column(f"imaginary {name}", unit, np.imag(np.asarray(values))))
            if frf.variance is not None:
                columns.append(Column(f"variance {name}", unit and f"({unit})^2", np.asarray(frf.variance[i, j])))
    return write_table(path, columns, delimiter=delimiter, endings=(".csv", ".txt"))
