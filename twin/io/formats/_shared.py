"""What all readers share: a column of numbers, its name and unit, and the limit on memory."""

import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from twin._checks import InputError

_LONGEST_NAME = 200
_MOST_COLUMNS, _WIDEST = 20_000, 64
# Symbols that stand for units in headings; pint would take nearly any letter for one.
_SYMBOLS = frozenset(
    (
        *("m", "mm", "cm", "km", "µm", "um", "μm", "nm", "in", "inch", "s", "sec", "ms", "µs"),
        *("us", "μs", "ns", "min", "h", "Hz", "kHz", "MHz", "N", "kN", "mN", "MN", "Nm", "Nmm"),
        *("kNm", "Ncm", "A", "mA", "V", "mV", "kV", "W", "kW", "mW", "J", "kJ", "kg", "g"),
        *("mg", "t", "rad", "mrad", "µrad", "deg", "°", "grad", "rpm", "RPM", "U", "Upm", "rev", "r"),
        *("%", "bar", "mbar", "Pa", "kPa", "MPa", "hPa", "°C", "degC", "C", "K", "Ohm", "ohm", "Ω"),
        *("H", "mH", "F", "µF", "dB", "T", "mT", "Wb", "inc", "ct", "counts", "digit", "lsb", "au"),
        *("dBV", "V_rms", "A_rms"),
    )
)


class Column(NamedTuple):
    """Numbers of a file under one name."""

    name: str
    values: np.ndarray
    unit: str = ""


def as_column(name: str, values: Any, unit: Any = "") -> Column:
    """A column with its numbers in double precision and a name that can be printed.

    Args:
        name: its name in the file; a unit in brackets at its end, "phi [deg]", is taken where there is no other.
        values: real or complex numbers; flattened.
        unit: its unit in the file, as text or bytes; anything else is none.
    """
    array = np.asarray(values).ravel()
    array = array.astype(np.complex128 if array.dtype.kind == "c" else np.float64)
    name, unit = printable(name), printable(unit)
    bracketed = None if unit else re.fullmatch(r"(.*\S)(?:[\s_]*\[|\s+\()((?!\d+[\])])[^\[\]()]+)[\])]", name)
    if bracketed and looks_like_unit(bracketed[2]):
        name, unit = bracketed[1].rstrip("_"), _plain(bracketed[2].strip())
    return Column(name, array, unit)


def is_called(wanted: str, name: str, unit: str) -> bool:
    """Whether a channel is meant: by its name, or by the heading of name and unit that the file has.

    Args:
        wanted: what was asked for.
        name: the channel's name.
        unit: its unit in the file.
    """
    return wanted == name or (bool(unit) and split_unit(wanted) == (name, unit))


def columns_of(
    name: str, values: np.ndarray, unit: Any, remarks: list[str], numbered: str = "{}[{}]", first: int = 0
) -> list[Column]:
    """The columns of an array: itself if it is a vector, else those along its shorter side.

    Args:
        name: its name in the file.
        values: real or complex numbers of any shape.
        unit: its unit in the file.
        remarks: what is left out is added here.
        numbered: how a column of a matrix is called, from name and number.
        first: number of the first column.
    """
    name = printable(name)
    if values.ndim < 2 or max(values.shape) == values.size:
        return [as_column(name, values, unit)]
    name, _, unit = as_column(name, (), unit)
    table = values.reshape(values.shape[0], -1)
    table = table.T if table.shape[0] < table.shape[1] else table
    if table.shape[1] > _WIDEST:
        remarks.append(f"{name!r} has {table.shape[1]} columns and is left out.")
        return []
    return [as_column(numbered.format(name, first + i), table[:, i], unit) for i in range(table.shape[1])]


def finite_number(value: Any) -> float | None:
    """A number of a file's properties; None where it is none.

    Args:
        value: anything.
    """
    try:
        number = float(value)
    except (TypeError, ValueError):
        return None
    return number if np.isfinite(number) else None


def printable(text: Any) -> str:
    """Text of a file without what a terminal would obey, shortened.

    Args:
        text: text or bytes; anything else gives an empty text.
    """
    if isinstance(text, np.ndarray) and text.size == 1:
        text = text.reshape(-1)[0]
    if isinstance(text, bytes):
        text = text.decode("utf-8", errors="replace")
    if not isinstance(text, str):
        return ""
    text = "".join(sign if sign.isprintable() else " " for sign in text[: 2 * _LONGEST_NAME])
    return " ".join(text.split())[:_LONGEST_NAME]


def looks_like_unit(text: str) -> bool:
    """Whether a text is written like a unit: symbols of units, powers and divisions.

    Args:
        text: as found in a heading.
    """
    text = text.strip()
    if text in ("-", "1", "[-]"):
        return True
    parts = [part for part in re.split(r"[\s/*·⋅^()\d²³⁻¹+-]+", text) if part]
    return bool(parts) and all(part in _SYMBOLS for part in parts)


def split_unit(heading: str) -> tuple[str, str]:
    """Name and unit of a heading such as "x [mm]", "x (mm)", "x/mm", "x in mm" or "x, mm".

    Args:
        heading: as the file has it.

    Returns:
        Name and unit; an empty unit where there is none.
    """
    heading = heading.strip()
    bracketed = re.fullmatch(r"(.*?)[\s_]*[\[<]\s*([^\[\]<>]*?)\s*[\]>]", heading)
    if bracketed and bracketed[1]:
        return bracketed[1].strip(), _plain(bracketed[2])
    for pattern in (
        r"(.*?)\s*\((.+)\)",
        r"(.*?)\s*/\s*\((.+)\)",
        r"([^/]+?)\s*/\s*(.+)",
        r"(.+?)\s+in\s+(.+)",
        r"(.+?),\s*(.+)",
    ):
        found = re.fullmatch(pattern, heading)
        if found and found[1] and looks_like_unit(found[2]):
            return found[1].strip().removesuffix("/").strip(), _plain(found[2].strip())
    return heading, ""


def _plain(unit: str) -> str:
    return {"-": "1", "U/min": "rpm", "°": "deg", "°C": "degC", "%": "percent"}.get(unit, unit)


def check_room(needed: int, limit: int, file: Path, what: str) -> None:
    """Raise if a file declares more than may be read.

    Args:
        needed: bytes declared.
        limit: bytes allowed.
        file: the file.
        what: what is declared, for the message.

    Raises:
        InputError: if it is too much.
    """
    if needed > limit or needed < 0:
        raise InputError(
            f"{str(file)!r} declares {needed / 1e6:.4g} MB ({what}), but at most {limit / 1e6:.4g} MB are read. If it "
            "is sound, give a larger limit; else export it again."
        )


def check_count(columns: int, file: Path) -> None:
    """Raise if a file has more columns than any measurement.

    Args:
        columns: how many.
        file: the file.

    Raises:
        InputError: if there are too many.
    """
    if columns > _MOST_COLUMNS:
        raise InputError(f"{str(file)!r} has {columns} columns, more than {_MOST_COLUMNS}. Check that it is sound.")
