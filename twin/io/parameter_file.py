"""Estimated parameters in TOML: one table per parameter, named by its dotted path into the model.

A file reads like this:

    # drivetwin parameter file

    ["friction.coulomb"]
    value = 20.39
    unit = "N"
    standard_error = 0.1
    lower = 0.0
    upper = inf
    source = "fit of 2024-05-02"

    #--- end of parameter file ---

Numbers keep their last bit. The two marking lines let a file that was cut short be told from a whole one; a file
written by hand may leave both out.
"""

import math
import os
import re
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from twin._checks import InputError
from twin.io._files import existing_file
from twin.io._whole_file import whole_file

_FIRST_LINE = "# drivetwin parameter file"
_LAST_LINE = "#--- end of parameter file ---"
# In the order in which they are written.
_KEYS = ("value", "unit", "standard_error", "lower", "upper", "source")


@dataclass(frozen=True)
class ParameterEntry:
    """One parameter with its estimate.

    Raises:
        InputError: if the path or the unit is empty, a number is NaN, the standard error is negative, or the lower
            bound lies above the upper one.
    """

    path: str
    """Dotted path into the model, such as `friction.coulomb`."""
    value: float | int
    """Estimate, in `unit`."""
    unit: str
    """SI unit; "1" for a plain number."""
    standard_error: float | int | None = None
    """Standard error of the estimate, in `unit`; None if unknown, inf if the data do not determine the parameter."""
    lower: float | int | None = None
    """Lower bound, in `unit`; None if there is none."""
    upper: float | int | None = None
    """Upper bound, in `unit`; None if there is none."""
    source: str = ""
    """Where the value comes from."""

    def __post_init__(self) -> None:
        for key in ("path", *_KEYS):
            object.__setattr__(self, key, _sound(self.path, key, getattr(self, key)))
        if self.standard_error is not None and self.standard_error < 0:
            raise InputError(
                f"standard_error of parameter {self.path!r} must not be negative, but is {self.standard_error!r}. "
                "Leave it out if it is unknown."
            )
        if self.lower is not None and self.upper is not None and self.lower > self.upper:
            raise InputError(
                f"lower of parameter {self.path!r} must not lie above upper, but is {self.lower!r} against "
                f"{self.upper!r}. Swap or correct the bounds."
            )


def write_parameters(path: str | os.PathLike[str], entries: Iterable[ParameterEntry], *, header: str = "") -> Path:
    """Write parameters to a TOML file, whole or not at all.

    The text goes to a temporary file first, which then takes the place of the old one, so that no reader and no crash
    ever meets half a file.

    Args:
        path: the file; one that exists is replaced.
        entries: the parameters, in the order to write them.
        header: comment put at the top, such as the data and the run they come from; may have several lines.

    Returns:
        Path of the file.

    Raises:
        InputError: if there is no entry, two have the same path, a text cannot be encoded, or the folder does not
            exist.
    """
    file = Path(path)
    text = _as_text(tuple(entries), header, file)
    try:
        content = text.encode("utf-8")
    except UnicodeEncodeError as error:
        raise InputError(f"the parameters for {str(file)!r} hold text that UTF-8 cannot encode: {error}.") from error
    with whole_file(file) as temporary:
        temporary.write_bytes(content)
    return file


def read_parameters(path: str | os.PathLike[str]) -> tuple[ParameterEntry, ...]:
    """Read parameters from a TOML file.

    Args:
        path: a file as `write_parameters` writes it, or one written by hand in that layout.

    Returns:
        The parameters in the order of the file.

    Raises:
        InputError: if the file does not exist, is cut short or not TOML (with line and column) or holds no parameter,
            or if a table lacks its value or unit, has an unknown key or an entry that cannot be used (with table and
            key).
    """
    file = existing_file(path, "parameter file")
    try:
        text = file.read_bytes().decode("utf-8-sig")  # editors on Windows put a mark in front
    except UnicodeDecodeError as error:
        raise InputError(f"parameter file {str(file)!r} is not UTF-8 text: {error}. Save it as UTF-8.") from error
    lines = text.replace("\r\n", "\n").split("\n")
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(
            f"parameter file {str(file)!r} is not valid TOML: {error}{_quote_line(str(error), lines)}. "
            "Repair that line; the file may be cut short."
        ) from error
    if lines[0] == _FIRST_LINE and _LAST_LINE not in lines:
        raise InputError(
            f"parameter file {str(file)!r} is cut short: after line {len(lines)} its last line "
            f"{_LAST_LINE!r} is missing. Write or copy it again."
        )
    if not tables:
        raise InputError(
            f"parameter file {str(file)!r} holds no parameter; it may be cut short. Write one table for each "
            'parameter, such as ["friction.coulomb"] with value and unit.'
        )
    return tuple(_as_entry(name, table, file, lines) for name, table in tables.items())


def _as_text(entries: tuple[ParameterEntry, ...], header: str, file: Path) -> str:
    import tomlkit

    if not entries:
        raise InputError(f"there is no parameter to write to {str(file)!r}. Give at least one entry.")
    document = tomlkit.document()
    document.add(tomlkit.comment(_FIRST_LINE.removeprefix("# ")))
    for line in re.split(r"[\x00-\x08\x0a-\x1f\x7f]+", header) if header else ():
        document.add(tomlkit.comment(line))
    for entry in entries:
        if entry.path in document:
            raise InputError(
                f"parameter {entry.path!r} occurs twice among those to write to {str(file)!r}. Give each path once."
            )
        table = tomlkit.table()
        for key in _KEYS:
            entered = getattr(entry, key)
            if entered is not None and not (key == "source" and not entered):
                table.add(key, entered)
        document.add(tomlkit.nl())
        document.add(entry.path, table)
    return tomlkit.dumps(document).rstrip("\n") + f"\n\n{_LAST_LINE}\n"


def _as_entry(name: str, table: object, file: Path, lines: list[str]) -> ParameterEntry:
    if not isinstance(table, dict):
        raise InputError(
            f"parameter file {str(file)!r}{_line_of(name, None, lines)}: key {name!r} stands outside of any table. "
            'Put it under the table of its parameter, such as ["friction.coulomb"].'
        )
    for key, entered in table.items():
        if key not in _KEYS:
            nested = f'; quote a dotted path as a whole: ["{name}.{key}"]' if isinstance(entered, dict) else ""
            raise InputError(
                f"parameter file {str(file)!r}{_line_of(name, key, lines)}: parameter {name!r} has the unknown key "
                f"{key!r}; known are {', '.join(_KEYS)}. Correct or remove it{nested}."
            )
    for key in ("value", "unit"):
        if key not in table:
            raise InputError(
                f"parameter file {str(file)!r}{_line_of(name, None, lines)}: parameter {name!r} has no {key}. "
                f"Add the key {key!r} to its table."
            )
    try:
        return ParameterEntry(name, **{key: _sound(name, key, entered) for key, entered in table.items()})
    except InputError as error:
        key = str(error).split(" ", 1)[0]
        raise InputError(f"parameter file {str(file)!r}{_line_of(name, key, lines)}: {error}") from error


def _sound(path: str, key: str, entered: object) -> Any:
    """The entry of one key as text or float; None stays where it may."""
    if key in ("path", "unit", "source"):
        if not isinstance(entered, str) or (key != "source" and not entered.strip()):
            cure = 'Write "1" for a plain number.' if key == "unit" else "Give it as text."
            raise InputError(f"{key} of parameter {path!r} must be non-empty text, but is {entered!r}. {cure}")
        return entered
    if entered is None and key != "value":
        return None
    # A bool is an int, and NumPy's numbers are none but can be converted.
    usable = not isinstance(entered, bool | str | bytes) and hasattr(entered, "__float__")
    try:
        number = float(entered) if usable else math.nan  # pyright: ignore[reportArgumentType]
    except (OverflowError, TypeError, ValueError):
        number = math.nan
    if math.isnan(number):
        raise InputError(
            f"{key} of parameter {path!r} must be a number, but is {entered!r}. Give a number in its unit."
        )
    return number


def _quote_line(message: str, lines: list[str]) -> str:
    found = re.search(r"at line (\d+)", message)
    number = min(int(found.group(1)) if found else len(lines), len(lines))
    while number > 1 and not lines[number - 1].strip():
        number -= 1
    return f", near {lines[number - 1].strip()!r} on line {number}"


def _line_of(name: str, key: str | None, lines: list[str]) -> str:
    """Where a table, or a key in it, stands; empty if it is written in some unusual way."""
    table = ""
    for number, line in enumerate(lines, start=1):
        text = line.strip()
        if text.startswith("["):
            table = text.strip("[]\"' ")
            found = text == f"[{name}.{key}]" or (key is None and table == name)
        else:
            found = table == (name if key else "") and text.split("=")[0].strip("\"' ") == (key or name)
        if found:
            return f", line {number}"
    return ""
