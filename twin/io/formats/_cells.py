"""Cells of delimited text: which are numbers, which are clock times, and how a line falls into cells."""

import csv
import re
from collections.abc import Sequence

_CLOCK = r"\d{1,2}:\d{2}(:\d{2}([.,]\d+)?)?"
CLOCK = re.compile(_CLOCK)
DATE = re.compile(
    rf"(\d{{4}}-\d{{2}}-\d{{2}}|\d{{1,2}}\.\d{{1,2}}\.\d{{4}}|\d{{1,2}}/\d{{1,2}}/\d{{4}}|\d{{4}}/\d{{2}}/\d{{2}})"
    rf"([T ]{_CLOCK}(Z|[+-]\d{{2}}:?\d{{2}})?)?"
)
MISSING = frozenset({"", "-", "--", "---", "nan", "na", "n/a", "#n/a", "null", "none", "1.#qnan", "-1.#ind", "-nan"})
BLANKS = " "
_NUMBER = {
    decimal: re.compile(rf"[+-]?(\d+({re.escape(decimal)}\d*)?|{re.escape(decimal)}\d+)([eE][+-]?\d+)?|[+-]?inf", re.I)
    for decimal in ".,"
}


def split_line(line: str, delimiter: str) -> list[str]:
    """Cells of one line, without blanks around them.

    Args:
        line: the line without its end.
        delimiter: one character; a blank stands for any run of blanks and tabs.
    """
    if delimiter == BLANKS:
        # A unit in brackets belongs to the heading before it.
        return re.sub(r"\s+(?=[\[(][^\])]*[\])])", "\x00", line.strip()).replace("\x00", "_").split()
    if '"' not in line:
        return [cell.strip() for cell in line.split(delimiter)]
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])]
    except csv.Error:
        return [cell.strip() for cell in line.split(delimiter)]


def is_number(cell: str, decimal: str, thousands: str | None = None) -> bool:
    """Whether a cell is a number.

    Args:
        cell: its text.
        decimal: decimal separator.
        thousands: separator of thousands, if any.
    """
    if thousands and re.fullmatch(rf"[+-]?\d{{1,3}}({re.escape(thousands)}\d{{3}})+(\D.*)?", cell):
        cell = cell.replace(thousands, "")
    return _NUMBER[decimal].fullmatch(cell) is not None


def is_clock(cell: str) -> bool:
    """Whether a cell is a clock time or a date.

    Args:
        cell: its text.
    """
    return CLOCK.fullmatch(cell) is not None or DATE.fullmatch(cell) is not None


def is_missing(cell: str) -> bool:
    """Whether a cell stands for a sample that is missing.

    Args:
        cell: its text.
    """
    return cell.lower() in MISSING


def thousands_of(cells: Sequence[str], decimal: str, delimiter: str) -> str | None:
    """The separator of thousands, if a cell shows one without doubt.

    Args:
        cells: any cells of the data.
        decimal: decimal separator.
        delimiter: delimiter of the columns.
    """
    for mark in ("'", "’", "," if decimal == "." else "."):
        sure = rf"[+-]?\d{{1,3}}({mark if mark != '.' else chr(92) + '.'}\d{{3}})+"
        several = re.compile(sure + rf"{re.escape(decimal)}\d+")
        twice = re.compile(sure.replace(")+", "){2,}"))
        if any(several.fullmatch(cell) or twice.fullmatch(cell) for cell in cells):
            return mark
        if mark in "'’" and any(re.fullmatch(sure, cell) for cell in cells):
            return mark
    return None
