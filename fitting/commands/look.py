"""`drivetwin look FILE`."""

import argparse
import inspect
from pathlib import Path
from typing import Any

from fitting.commands._out_folder import add_json, close_folder, open_folder
from fitting.commands._outcome import Outcome
from twin._input_error import InputError

HELP = "look at a file of measurements: channels, units, suspicious spots, and how to name them in a study"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("file", type=Path, metavar="FILE", help="delimited text, MAT, UFF, HDF5, TDMS, WAV or NPZ")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for pictures; without it none are drawn")
    parser.add_argument("--force", action="store_true", help="replace the results of an earlier run in that folder")
    parser.add_argument("--format", metavar="NAME", help="name of the format, where it is not known by its content")
    parser.add_argument("--time", metavar="COLUMN", help="name of the time column, where it is not found by itself")
    parser.add_argument(
        "--option",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="option of the format's reader, such as delimiter=';', decimal=',', header_line=3 or rate=2000",
    )
    add_json(parser)


def run(options: argparse.Namespace) -> Outcome:
    """Look at the file."""
    from twin.io.look import look
    from twin.io.measurement import read_measurement

    given = dict(_pair(text) for text in options.option)
    if options.time is not None:
        given["time"] = options.time
    try:
        measurement = read_measurement(options.file, format=options.format, **_typed(given))
    except InputError:
        if (modes := _modes(options.file)) is None:
            raise
        return modes
    seen = look(measurement)
    text, summary = seen.text(), seen.summary()
    if options.out is not None:
        from twin.io.look_plots import save_looks

        folder = open_folder(options.out, force=options.force)
        files = save_looks(seen.measurement, folder)
        close_folder(folder)
        text += f"\n\nPictures in {folder}: {', '.join(file.name for file in files) or 'none'}"
        summary["pictures"] = [str(file) for file in files]
    return Outcome(text, summary)


def _modes(file: Path) -> Outcome | None:
    """The modes of a universal file that holds no measurements but these; None for any other file."""
    from twin.io._mode_list import listed_modes
    from twin.io.formats import universal

    if not file.is_file():  # a pipe would wait for somebody to write
        return None
    with file.open("rb") as stream:
        if not universal.matches(stream.read(256)):
            return None
    found = listed_modes(file)
    if not found:
        return None
    lines = [f"{file}: universal, {len(found)} modes at {found[0].nodes} nodes (dataset 55), no measurements"]
    lines += [f"  {text}" for text in found[0].header[1:]]
    lines += ["", "mode  frequency [Hz]  damping ratio"]
    lines += [f"{one.number:4}  {one.frequency:14.6g}  {one.damping_ratio:13.6g}" for one in found]
    summary = {"file": str(file), "format": "universal", "modes": [one._asdict() for one in found]}
    return Outcome("\n".join(lines), summary)


def _pair(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals or not name:
        raise InputError(f"--option {text!r} is no NAME=VALUE. Write, for instance, --option delimiter=';'.")
    return name.strip().replace("-", "_"), value


def _typed(given: dict[str, str]) -> dict[str, Any]:
    """Texts as whatever the readers take: a number where one of them does."""
    from twin.io.measurement import formats, options_of

    readers = [options_of(reader) for reader in formats().values()]
    typed: dict[str, Any] = {}
    for name, value in given.items():
        kinds = {str(inspect.formatannotation(known[name].annotation)) for known in readers if name in known}
        typed[name] = _number(name, value, kinds)
    return typed


def _number(name: str, value: str, kinds: set[str]) -> Any:
    if any("dict" in kind for kind in kinds):
        raise InputError(f"--option {name} takes more than a text can say. Use read_measurement in Python.")
    if any("str" in kind for kind in kinds) or not kinds:
        return value.encode().decode("unicode_escape") if value in (r"\t", r"\x20") else value
    whole = all(kind.startswith("int") for kind in kinds)
    try:
        return int(value) if whole else float(value)
    except ValueError as error:
        raise InputError(f"--option {name} must be a number, but is {value!r}. Correct it.") from error
