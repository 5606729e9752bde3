"""Delimited text: any delimiter, decimal point or comma, headings and units wherever they stand, clock times."""

import codecs
import io
import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from twin._checks import InputError
from twin.io.formats._abscissa import with_abscissa
from twin.io.formats._cells import BLANKS, MISSING, is_clock, is_missing, is_number, split_line
from twin.io.formats._clock import clock_seconds
from twin.io.formats._shared import Column, check_count, check_room
from twin.io.formats._sniff import Layout, sniff
from twin.io.measurement import MeasuredChannel

ENDINGS = (".csv", ".txt", ".dat", ".tsv", ".asc", ".tab", ".prn", ".log")
_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_CONTROL = frozenset(range(32)) - {*b"\t\n\r\x0b\x0c\x1a"}
_SNIFFED_LINES, _LONGEST_LINE, _FOOTER = 300, 1_000_000, 5


def matches(head: bytes) -> int:
    """Whether these first bytes are text."""
    if any(head.startswith(mark) for mark, _ in _MARKS) or _zeros(head) is not None:
        return 1
    return int(bool(head.strip()) and not any(byte in _CONTROL for byte in head))


def read(
    file: Path,
    limit: int,
    *,
    delimiter: str | None = None,
    decimal: str | None = None,
    thousands: str | None = None,
    encoding: str | None = None,
    header_line: int | None = None,
    first_data_line: int | None = None,
    time: str | None = None,
    time_unit: str | None = None,
    rate: float | None = None,
) -> tuple[list[MeasuredChannel], list[str]]:
    """Read a delimited text.

    Args:
        file: the file.
        limit: bytes that may be read.
        delimiter: delimiter of the columns; a blank for any run of blanks; None finds it.
        decimal: decimal separator, "." or ","; None finds it.
        thousands: separator of thousands; None finds it where it is beyond doubt.
        encoding: text encoding; None finds it.
        header_line: line of the headings, from 1; 0 for none; None finds it.
        first_data_line: line of the first sample, from 1; None finds it.
        time: name of the time column; None finds it.
        time_unit: unit of the time column; None takes the file's.
        rate: samples per second, where there is no time column.

    Raises:
        InputError: no text, no table of numbers, or a cell that is no number, with its line.
    """
    check_room(file.stat().st_size, limit, file, "text")
    _check_options(delimiter, decimal, header_line, first_data_line)
    encoding = encoding or _encoding(file)
    lines = list(itertools.islice(_lines(file, encoding), _SNIFFED_LINES))
    check_count(max((len(line.split(mark)) for line in lines[:20] for mark in "\t;,| "), default=0), file)
    told = dict(delimiter=delimiter, decimal=decimal, thousands=thousands)
    layout = sniff(lines, **told, header_line=header_line, first_data_line=first_data_line)
    if layout is None or "number" not in layout.kinds:
        raise InputError(
            f"{str(file)!r} has no table of numbers in its first {len(lines)} lines. Name delimiter, decimal and "
            "first_data_line, or export it again."
        )
    remarks = [
        f"Text in {encoding}, delimiter {'blanks' if layout.delimiter == BLANKS else repr(layout.delimiter)}, decimal "
        f"{layout.decimal!r}{f', thousands {layout.thousands!r}' if layout.thousands else ''}, samples from line "
        f"{layout.first}."
    ]
    columns = _columns(file, encoding, layout, remarks)
    if columns[0].values.size < 2:
        raise InputError(f"{str(file)!r} has a single row of numbers, which is no measurement. Export it again.")
    told_rate = layout.rate if rate is None else rate
    if not layout.names:
        remarks.append("There are no headings; the columns are numbered.")
    found: list[str] = []
    first_may_be_time = not layout.names and rate is None
    channels = with_abscissa(
        columns, file, found, time=time, time_unit=time_unit, rate=told_rate, first_may_be_time=first_may_be_time
    )
    return channels, remarks + found


def _columns(file: Path, encoding: str, layout: Layout, remarks: list[str]) -> list[Column]:
    count = len(layout.kinds)
    names = layout.names or tuple(f"column {number}" for number in range(1, count + 1))
    units = layout.units or ("",) * count
    clocks = [i for i, kind in enumerate(layout.kinds) if kind == "clock"]
    # Of a date beside a clock time only the clock is needed.
    used = {i: kind for i, kind in enumerate(layout.kinds) if kind == "number"} | {i: "clock" for i in clocks[-1:]}
    for i, kind in enumerate(layout.kinds):
        if i not in used and kind != "empty":
            remarks.append(f"Column {names[i]!r} holds {'dates' if kind == 'clock' else 'text'} and is left out.")
    table = _table(file, encoding, layout, used, remarks)
    columns = []
    for i in sorted(used):
        if used[i] == "clock":
            seconds, started = clock_seconds(table[i], names[i], file)
            remarks.append(f"Column {names[i]!r} holds clock times; times are counted from {started}.")
            name = names[i] if layout.names else "time"
            columns.append(Column(name, seconds, "s"))
        else:
            columns.append(Column(names[i], table[i].to_numpy(dtype=np.float64), units[i]))
    return columns


def _table(file: Path, encoding: str, layout: Layout, used: dict[int, str], remarks: list[str]) -> Any:
    """The columns used, as a pandas table."""
    fault, table = None, None
    try:
        table = _parsed(file, encoding, layout, used, None)
    except (ValueError, OverflowError) as error:  # the parser's errors, and those of the decoder, are ValueErrors
        fault = str(error)
    if table is not None and not table[layout.width].notna().any() and not table[[*used]].isna().to_numpy().any():
        return table
    rows = _sound_rows(file, encoding, layout, used, remarks, fault)
    if rows is None:
        return table
    try:
        return _parsed(file, encoding, layout, used, rows)
    except (ValueError, OverflowError) as error:
        raise InputError(f"{str(file)!r} is malformed beyond line {layout.first}: {error}. Export it again.") from error


def _parsed(file: Path, encoding: str, layout: Layout, used: dict[int, str], rows: int | None) -> Any:
    import pandas  # half a second to import

    with _opened(file, encoding) as text:
        return pandas.read_csv(
            text,
            sep=r"\s+" if layout.delimiter == BLANKS else layout.delimiter,
            decimal=layout.decimal,
            thousands=layout.thousands,
            header=None,
            names=list(range(layout.width + 1)),  # one more than there are, to see rows that are too long
            index_col=False,
            skiprows=layout.first - 1,
            nrows=rows,
            dtype={i: np.float64 if used.get(i) == "number" else str for i in range(layout.width + 1)},
            na_values=sorted({*MISSING, *(one.upper() for one in MISSING), "NaN", "1.#QNAN", "-1.#IND"}),
            keep_default_na=False,
            skipinitialspace=True,
            float_precision="round_trip",
            low_memory=False,
        )


def _sound_rows(
    file: Path, encoding: str, layout: Layout, used: dict[int, str], remarks: list[str], fault: str | None
) -> int | None:
    """Rows before a footer; None if all rows are sound. Raises for a bad row among good ones, with its line."""
    good, bad = 0, None
    for number, line in enumerate(_lines(file, encoding), start=1):
        if number < layout.first or not line.strip(" \t\r\x1a\x00"):
            continue
        cells = split_line(line, layout.delimiter)
        wrong = _fault(cells, layout, used)
        if bad is None and wrong is None:
            good += 1
        elif bad is None:
            bad = number, wrong, 1
        elif wrong is None or bad[2] >= _FOOTER:
            break
        else:
            bad = bad[0], bad[1], bad[2] + 1
    else:
        if bad is None and fault is None:
            return None
        if bad is not None and good and "cell" not in str(bad[1])[:4]:
            remarks.append(f"The last lines, from line {bad[0]} on, are no samples and are left out.")
            return good
    if bad is None:
        raise InputError(f"{str(file)!r} is malformed: {fault}. Export it again.")
    raise InputError(
        f"{str(file)!r} has {str(bad[1]).removeprefix('cell ')} on line {bad[0]}. Repair or remove that line, or name "
        "delimiter, decimal, thousands or first_data_line if they were not found rightly."
    )


def _fault(cells: list[str], layout: Layout, used: dict[int, str]) -> str | None:
    """What is wrong with a row; begins with "cell" where its other cells are sound."""
    while len(cells) > layout.width and cells[-1] == "":
        cells = cells[:-1]
    checked = [(i, cells[i]) for i in used if i < len(cells) and not is_missing(cells[i])]
    right = [
        is_clock(cell) if used[i] == "clock" else is_number(cell, layout.decimal, layout.thousands)
        for i, cell in checked
    ]
    mark = "cell " if any(right) else ""
    if len(cells) != layout.width and not (len(cells) == layout.width - 1 and layout.width > len(layout.kinds)):
        return f"{mark}{len(cells)} cells instead of {layout.width}"
    for (i, cell), fine in zip(checked, right, strict=True):
        if not fine:
            name = layout.names[i] if layout.names else f"column {i + 1}"
            return (
                f"{mark}{cell[:40]!r} in column {name!r}, where a number with decimal {layout.decimal!r} is expected,"
            )
    return None


def _check_options(delimiter: str | None, decimal: str | None, header: int | None, first: int | None) -> None:
    if delimiter is not None and (len(delimiter) != 1 or delimiter in '"\n\r' or delimiter.isalnum()):
        raise InputError(f"delimiter must be one character that is no letter or digit, but is {delimiter!r}.")
    if decimal not in (None, ".", ",") or (decimal is not None and decimal == delimiter):
        raise InputError(f"decimal must be '.' or ',' and differ from the delimiter, but is {decimal!r}.")
    if (header is not None and header < 0) or (first is not None and first <= (header or 0)):
        raise InputError(f"header_line is {header} and first_data_line {first}. Count lines from 1, headings first.")


def _zeros(head: bytes) -> str | None:
    """The encoding of wide characters without a mark."""
    pairs = head[: len(head) // 2 * 2]
    if len(pairs) < 16:
        return None
    for name, zeros, letters in (("utf-16-le", pairs[1::2], pairs[::2]), ("utf-16-be", pairs[::2], pairs[1::2])):
        if zeros.count(0) > 0.9 * len(zeros) and not any(byte in _CONTROL for byte in letters):
            return name
    return None


def _encoding(file: Path) -> str:
    with file.open("rb") as opened:
        head = opened.read(4096)
    for mark, name in _MARKS:
        if head.startswith(mark):
            return name
    wide = _zeros(head)
    if wide:
        return wide
    if any(byte in _CONTROL for byte in head):
        raise InputError(
            f"{str(file)!r} is no text: it starts with {head[:8]!r}. Name its format, or export it as text."
        )
    decoder = codecs.getincrementaldecoder("utf-8")()
    with file.open("rb") as opened:
        try:
            while block := opened.read(1 << 20):
                decoder.decode(block)
            decoder.decode(b"", final=True)
        except UnicodeDecodeError:
            return "cp1252" if not any(byte in head for byte in b"\x81\x8d\x8f\x90\x9d") else "latin-1"
    return "utf-8"


def _opened(file: Path, encoding: str) -> io.TextIOWrapper:
    try:
        return file.open(encoding=encoding, newline=None, errors="replace" if encoding == "cp1252" else "strict")
    except LookupError as error:
        raise InputError(f"encoding {encoding!r} of {str(file)!r} is not known. Try 'utf-8' or 'latin-1'.") from error


def _lines(file: Path, encoding: str) -> Iterator[str]:
    number = 0
    with _opened(file, encoding) as text:
        try:
            while line := text.readline(_LONGEST_LINE):
                number += 1
                if len(line) >= _LONGEST_LINE:
                    raise InputError(f"Line {number} of {str(file)!r} is longer than a million characters. Check it.")
                yield line.rstrip("\n")
        except UnicodeError as error:
            raise InputError(
                f"{str(file)!r} cannot be decoded as {encoding} after line {number}: {error}. Name its encoding, such "
                "as 'latin-1', or export it as UTF-8."
            ) from error
