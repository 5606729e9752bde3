"""Delimited text in: chosen columns of a CSV file become a record in SI units."""

import csv
import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from twin._checks import InputError
from twin.io._files import existing_file
from twin.io.units import si_unit, to_si
from twin.record import Record


def read_csv(
    path: str | os.PathLike[str],
    columns: Mapping[str, tuple[str, str] | tuple[str, str, str]],
    *,
    time: tuple[str, str] = ("t", "s"),
    delimiter: str = ",",
    decimal: str = ".",
    header_line: int = 1,
    first_data_line: int | None = None,
    encoding: str = "utf-8-sig",
    name: str | None = None,
) -> Record:
    """Read a record from a text file with one row per sample.

    Args:
        path: the file.
        columns: for each channel name the heading and the unit of its column, such as
            `{"position": ("x_mess", "mm")}`; a third entry gives a unit of the dimension expected.
        time: heading and unit of the time column.
        delimiter: one character between the columns, such as "," or ";" or a tab.
        decimal: decimal separator, "." or ",".
        header_line: line on which the headings stand, counted from 1.
        first_data_line: line of the first sample, where more than the headings must be skipped; None for the next line.
        encoding: text encoding; "latin-1" for many older instruments.
        name: what to call the record; None takes the file's name.

    Returns:
        The record, its times and channels in SI units.

    Raises:
        InputError: if the file cannot be read or decoded, a column is missing or given twice, a row is malformed or a
            cell is no finite number (with its line), a unit is wrong, or the samples make no sound record.
    """
    file = existing_file(path, "CSV file")
    if delimiter == decimal or len(delimiter) != 1 or decimal not in (".", ","):
        raise InputError(
            f"delimiter must be one character and decimal '.' or ',', and they must differ, but are {delimiter!r} and "
            f"{decimal!r}. A file with decimal commas mostly has ';' between its columns."
        )
    first = header_line + 1 if first_data_line is None else first_data_line
    if not 1 <= header_line < first:
        raise InputError(
            f"header_line must be at least 1 and first_data_line beyond it, but they are {header_line} and {first}. "
            "Count the lines from 1."
        )
    headings = {"time": time[0]} | {channel: column[0] for channel, column in columns.items()}
    if "time" in columns:
        raise InputError("columns must not contain 'time'. Give the time column by the argument time instead.")
    layout = _Layout(file, delimiter, decimal, header_line, first, encoding)
    _check_headings(layout, headings)
    raw = _read_columns(layout, headings)
    units, channels = {}, {}
    for channel, (_, unit, *expected) in columns.items():
        label = f"channel {channel!r} of {file.name}"
        channels[channel] = to_si(raw[channel], unit, *expected, name=label)
        units[channel] = si_unit(unit, *expected, name=label)
    times = to_si(raw["time"], time[1], "s", name=f"time of {file.name}")
    return Record.create(times, channels, units, name=file.stem if name is None else name)


@dataclass(frozen=True)
class _Layout:
    """How the text of the file is laid out."""

    file: Path
    delimiter: str
    decimal: str
    header_line: int
    first: int
    encoding: str

    def rows(self) -> Iterator[tuple[int, list[str]]]:
        """Pairs of line number and cells."""
        try:
            with self.file.open(encoding=self.encoding, newline="") as text:
                reader = csv.reader(text, delimiter=self.delimiter, skipinitialspace=True)
                for cells in reader:
                    yield reader.line_num, [cell.strip() for cell in cells]
        except (UnicodeDecodeError, LookupError) as error:
            raise InputError(
                f"CSV file {str(self.file)!r} cannot be decoded as {self.encoding}: {error}. "
                'Try encoding="latin-1", or export the file as UTF-8.'
            ) from error
        except csv.Error as error:
            raise InputError(
                f"CSV file {str(self.file)!r} is malformed: {error}. Export it again as plain text."
            ) from error

    def header(self) -> list[str]:
        """The headings."""
        for line, cells in self.rows():
            if line == self.header_line:
                return cells
        raise InputError(
            f"CSV file {str(self.file)!r} has no line {self.header_line}, where the headings should stand. "
            "Check header_line."
        )


def _check_headings(layout: _Layout, headings: Mapping[str, str]) -> None:
    header = layout.header()
    for channel, heading in headings.items():
        count = header.count(heading)
        if count == 0:
            hint = "; the delimiter is probably another one" if len(header) == 1 else ""
            raise InputError(
                f"CSV file {str(layout.file)!r} has no column {heading!r} for {channel!r} on line "
                f"{layout.header_line}; it has {', '.join(map(repr, header))}{hint}. "
                "Correct the heading, the delimiter or header_line."
            )
        if count > 1:
            raise InputError(
                f"CSV file {str(layout.file)!r} has {count} columns {heading!r} (for {channel!r}). "
                "Give them different headings."
            )


def _read_columns(layout: _Layout, headings: Mapping[str, str]) -> dict[str, np.ndarray]:
    import pandas  # half a second to import

    header = layout.header()
    try:
        table = pandas.read_csv(
            layout.file,
            sep=layout.delimiter,
            skiprows=[*range(layout.header_line - 1), *range(layout.header_line, layout.first - 1)],
            encoding=layout.encoding,
            skipinitialspace=True,
            dtype=str,
            keep_default_na=False,
        )
        # Rows longer than the header make pandas take the first column for row labels and shift all others.
        if isinstance(table.index, pandas.RangeIndex) and table.shape[1] == len(header) and len(table) > 0:
            return {
                channel: np.array([_number(cell, layout.decimal) for cell in table.iloc[:, header.index(heading)]])
                for channel, heading in headings.items()
            }
        reason = "there is no table of numbers under its headings"
    except (ValueError, AttributeError, TypeError) as error:  # from the parser, and from cells that a row lacks
        reason = str(error)
    raise _malformed(layout, headings, header) or InputError(
        f"CSV file {str(layout.file)!r} is malformed: {reason}. "
        "Check header_line and the delimiter, or export it again."
    )


def _malformed(layout: _Layout, headings: Mapping[str, str], header: list[str]) -> InputError | None:
    """The error that names the first bad line; found by a slow second reading."""
    for line, cells in layout.rows():
        if line < layout.first or not any(cells):
            continue
        if len(cells) != len(header):
            return InputError(
                f"CSV file {str(layout.file)!r} has {len(cells)} columns on line {line}, but {len(header)} headings. "
                "Repair that line; it may be cut short."
            )
        for channel, heading in headings.items():
            cell = cells[header.index(heading)]
            if not _is_number(cell, layout.decimal):
                return InputError(
                    f"CSV file {str(layout.file)!r} has {cell!r} on line {line} in column {heading!r} ({channel!r}), "
                    f"but a finite number with the decimal separator {layout.decimal!r} is expected. "
                    "Repair that cell, or set decimal and first_data_line to suit the file."
                )
    return None


def _number(cell: str, decimal: str) -> float:
    # With a decimal comma a point would separate thousands, and 1.234 be read a thousand times too small.
    if decimal == "," and "." in cell:
        raise ValueError(f"{cell!r} has a point")
    number = float(cell.replace(decimal, "."))
    if not math.isfinite(number):
        raise ValueError(f"{cell!r} is not finite")
    return number


def _is_number(cell: str, decimal: str) -> bool:
    try:
        _number(cell, decimal)
    except ValueError:
        return False
    return True
