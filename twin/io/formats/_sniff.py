"""How a delimited text is laid out: found by looking at its first lines."""

import itertools
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from twin.io.formats._cells import BLANKS, is_clock, is_missing, is_number, split_line, thousands_of
from twin.io.formats._shared import looks_like_unit, printable, split_unit

_DELIMITERS = ("\t", ";", "|", ",", BLANKS)
_COMMENTS = ("#", "%", "!", "//", "*", "'", "$")
_RATE = re.compile(
    r"(?:sampl\w*[ _-]*(?:rate|freq\w*)|abtast(?:rate|freq\w*)|frequenz|rate|fs)"
    r"\W{0,12}?([\d.,]+(?:e[+-]?\d+)?)\W*([kM]?Hz)?",
    re.I,
)
_PERIOD = re.compile(
    r"(?:sampl\w*[ _-]*(?:time|period|interval)|abtast(?:zeit|periode|intervall)|dt|delta[ _]?t|increment|x_delta|ts)"
    r"\W{0,12}?([\d.,]+(?:e[+-]?\d+)?)\W*([mµu]?s)?",
    re.I,
)


@dataclass(frozen=True)
class Layout:
    """How a delimited text is laid out."""

    delimiter: str
    """One character; a blank for any run of blanks."""
    decimal: str
    """ "." or ","."""
    thousands: str | None
    """Separator of thousands."""
    first: int
    """Line of the first sample, from 1."""
    width: int
    """Cells in a row."""
    names: tuple[str, ...]
    """Headings without units; empty if there are none."""
    units: tuple[str, ...]
    """Units, as many as headings."""
    kinds: tuple[str, ...]
    """ "number", "clock", "text" or "empty" for each column."""
    rate: float | None
    """Sample rate that the lines above tell [Hz]."""


def sniff(
    lines: Sequence[str],
    *,
    delimiter: str | None = None,
    decimal: str | None = None,
    thousands: str | None = None,
    header_line: int | None = None,
    first_data_line: int | None = None,
) -> Layout | None:
    """Find the layout.

    Args:
        lines: the first lines of the text, without their ends.
        delimiter: delimiter, if known.
        decimal: decimal separator, if known.
        thousands: separator of thousands, if known.
        header_line: line of the headings from 1, if known; 0 for none.
        first_data_line: line of the first sample from 1, if known.

    Returns:
        The layout; None if no rows of numbers are found.
    """
    best, found = (0.0, 0), None
    start = first_data_line or (header_line + 1 if header_line else 1)
    for mark, point in itertools.product(
        _DELIMITERS if delimiter is None else (delimiter,), ".," if decimal is None else (decimal,)
    ):
        if mark == point:
            continue
        rows = [split_line(line, mark) for line in lines]
        many = thousands
        if many is None:
            many = thousands_of([cell for row in rows[-50:] for cell in row], point, mark)
        block = _block(rows, point, many, start)
        if block is None:
            continue
        first, width, quality = block
        score = (quality, width)
        if score > best:
            best, found = score, (mark, point, many, rows, first, width)
    if found is None:
        return None
    mark, point, many, rows, first, width = found
    data = [row for row in rows[first:] if len(row) >= width]
    kinds = tuple(_kind([row[column] for row in data[:200]], point, many) for column in range(width))
    while kinds and kinds[-1] == "empty":
        kinds = kinds[:-1]
    names, units = _headings(lines, mark, point, first, width, header_line)
    names, units = names[: len(kinds)], units[: len(kinds)]
    return Layout(mark, point, many, first + 1, width, names, units, kinds, _rate(lines[:first]))


def _value(cell: str, decimal: str, thousands: str | None) -> bool:
    return is_number(cell, decimal, thousands) or is_clock(cell)


def _block(rows: Sequence[list[str]], decimal: str, thousands: str | None, start: int) -> tuple[int, int, float] | None:
    """First row, width and quality of the longest block of rows with numbers."""
    good = [
        sum(_value(cell, decimal, thousands) for cell in row) if index >= start - 1 else 0
        for index, row in enumerate(rows)
    ]
    widths = Counter(len(row) for row, count in zip(rows, good, strict=True) if count)
    if not widths:
        return None
    width = max(widths, key=lambda one: (widths[one] * (1 + 0.01 * one), one))
    usable = [len(row) == width and count > 0 for row, count in zip(rows, good, strict=True)]
    typical = Counter(count for count, fits in zip(good, usable, strict=True) if fits).most_common(1)[0][0]
    first = next(i for i, fits in enumerate(usable) if fits and 2 * good[i] >= typical)
    body = [row for row in rows[first:] if any(row)]
    cells = sum(max(len(row), 1) for row in body)
    right = sum(good[i] for i in range(first, len(rows)) if usable[i])
    filled = sum(is_missing(cell) for i in range(first, len(rows)) if usable[i] for cell in rows[i])
    return first, width, round((right + 0.5 * filled) / cells, 3) * sum(usable) if right else 0.0


def _kind(cells: Sequence[str], decimal: str, thousands: str | None) -> str:
    held = [cell for cell in cells if not is_missing(cell)]
    if not held:
        return "empty" if all(cell == "" for cell in cells) else "number"
    numbers = sum(is_number(cell, decimal, thousands) for cell in held)
    clocks = sum(is_clock(cell) for cell in held)
    if clocks > max(numbers, len(held) / 2):
        return "clock"
    return "number" if numbers > len(held) / 2 else "text"


def _headings(
    lines: Sequence[str], delimiter: str, decimal: str, first: int, width: int, header_line: int | None
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    if header_line == 0:
        return (), ()
    if header_line is not None:
        chosen = header_line - 1
    else:
        above = [i for i in range(first) if _heading_cells(lines[i], delimiter, width, decimal) is not None]
        above = [i for i in above if first - i <= 4]
        if not above:
            return (), ()
        chosen = above[-1]
        units_row = _heading_cells(lines[chosen], delimiter, width, decimal)
        if len(above) > 1 and units_row is not None and _all_units(units_row):
            chosen = above[-2]
    cells = _heading_cells(lines[chosen], delimiter, width, decimal) if chosen < len(lines) else None
    if cells is None:
        cells = [*split_line(lines[chosen], delimiter), *[""] * width][:width] if chosen < len(lines) else [""] * width
    pairs = [split_unit(printable(cell).replace("_[", " [").replace("_(", " (")) for cell in cells]
    units = [unit for _, unit in pairs]
    if chosen + 1 < first:
        beneath = _heading_cells(lines[chosen + 1], delimiter, width, decimal)
        if beneath is not None and _all_units(beneath):
            given = [split_unit(f"x [{cell.strip('[]()')}]")[1] if cell else "" for cell in beneath]
            units = [unit or other for unit, other in zip(units, given, strict=True)]
    names = tuple(name or f"column {number}" for number, (name, _) in enumerate(pairs, start=1))
    return names, tuple(units)


def _heading_cells(line: str, delimiter: str, width: int, decimal: str) -> list[str] | None:
    text = line.strip("\r\n \ufeff")
    for mark in _COMMENTS:
        if text.startswith(mark):
            text = text[len(mark) :].lstrip()
            break
    cells = split_line(text, delimiter)
    if len(cells) == width + 1 and cells[-1] == "":
        cells = cells[:-1]
    if len(cells) == width - 1 and delimiter != BLANKS:
        cells = [*cells, ""]
    if len(cells) != width or not any(cells) or any(is_number(cell, decimal) for cell in cells):
        return None
    return cells


def _all_units(cells: Sequence[str]) -> bool:
    held = [cell for cell in cells if cell]
    return bool(held) and all(looks_like_unit(cell.strip("[]()<>") or "-") for cell in held)


def _rate(lines: Sequence[str]) -> float | None:
    for line in lines:
        for pattern, factors, inverse in (
            (_RATE, {"kHz": 1e3, "MHz": 1e6}, False),
            (_PERIOD, {"ms": 1e-3, "µs": 1e-6, "us": 1e-6}, True),
        ):
            told = pattern.search(line)
            if told is None:
                continue
            try:
                value = float(told[1].rstrip(".,").replace(",", ".")) * factors.get(told[2] or "", 1.0)
            except ValueError:
                continue
            if 0 < value < float("inf"):
                return 1 / value if inverse else value
    return None
