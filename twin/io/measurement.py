"""What a file of measurements holds, as it says it: channels with their units and abscissas, nothing converted.

`read_measurement` reads any of the formats in `twin.io.formats`; `twin.io.prepare` makes a record in SI of the result.
"""

import difflib
import html
import importlib
import inspect
import os
import pkgutil
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from twin._checks import InputError
from twin.io._files import existing_file

READ_LIMIT = 2_000_000_000
"""Bytes of samples that are read from one file, unless told otherwise."""
_HEAD = 4096
_HEADINGS = ("channel", "unit", "samples", "rate", "from", "to")


@dataclass(frozen=True, eq=False)
class MeasuredChannel:
    """One channel as the file has it."""

    name: str
    """Its name in the file."""
    values: np.ndarray
    """Samples, shape (samples,), float64, or complex128 for spectra."""
    unit: str = ""
    """Unit as the file says; empty where it says nothing."""
    times: np.ndarray | None = None
    """Abscissa [s] or [Hz], shape (samples,); None where the file has none."""
    abscissa: str = "index"
    """"time", "frequency", or "index" where samples are only counted."""

    def __post_init__(self):
        if self.abscissa not in ("time", "frequency", "index") or (self.times is None) != (self.abscissa == "index"):
            raise InputError(f"abscissa of channel {self.name!r} is {self.abscissa!r}, which does not suit its times.")
        if self.values.ndim != 1 or (self.times is not None and self.times.shape != self.values.shape):
            shapes = self.values.shape, None if self.times is None else self.times.shape
            raise InputError(f"channel {self.name!r} has values and times of shapes {shapes}. Give one time a sample.")

    @property
    def rate(self) -> float | None:
        """Samples per second [1/s], or per Hz: the inverse of the median step; None without abscissa."""
        if self.times is None or self.times.size < 2:
            return None
        step = float(np.median(np.diff(self.times)))
        return 1.0 / step if step > 0 and np.isfinite(step) else None

    def row(self) -> tuple[str, ...]:
        """Name, unit, samples, rate and ends of the abscissa, as text."""
        if self.times is None or self.times.size == 0:
            return self.name, self.unit, str(self.values.size), "", "", ""
        unit = "Hz" if self.abscissa == "frequency" else "s"
        rate = "" if self.rate is None or self.abscissa != "time" else f"{self.rate:.6g} Hz"
        ends = (f"{end:.6g} {unit}" for end in (self.times[0], self.times[-1]))
        return self.name, self.unit, str(self.values.size), rate, *ends


@dataclass(frozen=True, eq=False, repr=False)
class Measurement:
    """The channels of one file."""

    name: str
    """What it is called: the file's name without its ending."""
    source: str
    """The file it was read from."""
    channels: tuple[MeasuredChannel, ...]
    """Channels in the file's order."""
    remarks: tuple[str, ...] = ()
    """What the reader assumed or left out, one sentence each."""
    format: str = ""
    """Name of the format."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels."""
        return tuple(channel.name for channel in self.channels)

    def __getitem__(self, name: str) -> MeasuredChannel:
        """One channel by name, or by its heading in the file, such as "phi [deg]".

        Raises:
            InputError: if there is none of that name; the closest come first in the message.
        """
        from twin.io.formats._shared import is_called  # the formats themselves import this module

        for channel in self.channels:
            if channel.name == name:
                return channel
        for channel in self.channels:
            if is_called(name, channel.name, channel.unit):
                return channel
        raise InputError(
            f"{self.source!r} has no channel {name!r}; it has {listed(name, self.names)}. Use one of these names."
        )

    def __iter__(self) -> Iterator[MeasuredChannel]:
        return iter(self.channels)

    def __len__(self) -> int:
        return len(self.channels)

    def __repr__(self) -> str:
        rows = [_HEADINGS, *(channel.row() for channel in self.channels)]
        widths = [max(len(row[column]) for row in rows) for column in range(len(_HEADINGS))]
        lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
        told = [f"  {remark}" for remark in self.remarks]
        return "\n".join([f"{self.name} ({self.format or 'made here'}, {len(self)} channels)", *lines, *told])

    def _repr_html_(self) -> str:
        def line(cells: tuple[str, ...], tag: str) -> str:
            return "<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in cells) + "</tr>"

        body = "".join(line(channel.row(), "td") for channel in self.channels)
        told = "".join(f"<li>{html.escape(remark)}</li>" for remark in self.remarks)
        return f"<b>{html.escape(self.name)}</b><table>{line(_HEADINGS, 'th')}{body}</table><ul>{told}</ul>"


def read_measurement(
    path: str | os.PathLike[str], *, format: str | None = None, limit: int = READ_LIMIT, **options: Any
) -> Measurement:
    """Read a file of measurements: its format is known by its content, or else by its ending.

    Args:
        path: the file: delimited text, MAT, universal file, HDF5, TDMS, WAV or NPZ.
        format: name of the format, as of the modules in `twin.io.formats`; None finds it.
        limit: bytes of samples that may be read; a file that declares more is refused before anything is allocated.
        options: those of the format's reader, such as `delimiter` and `decimal` of "delimited".

    Returns:
        The channels and what was assumed.

    Raises:
        InputError: if the file cannot be read, is of no known format, or an option is unknown.
    """
    file = existing_file(path, "Measurement file")
    offered = formats()
    if format is not None and format not in offered:
        raise InputError(f"format is {format!r}, but {listed(format, tuple(offered))} are known. Use one of these.")
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")  # what a library grumbles about is either refused here or told as a remark
        try:
            name = format or _found_format(file, offered)
            reader = offered[name]
            _check_options(name, reader, options)
            channels, remarks = reader.read(file, limit, **options)
        except InputError as error:
            if str(file) in str(error) or file.name in str(error):
                raise
            raise InputError(f"{str(file)!r}: {error}") from error
        except OSError as error:
            raise InputError(f"{str(file)!r} cannot be read: {error}. Copy it again and check its rights.") from error
        except Exception as error:  # libraries raise nearly anything on a damaged file
            told = " ".join(str(error).split())[:200]
            raise InputError(
                f"{str(file)!r} cannot be read as {format or 'what it seems to be'} ({type(error).__name__}: "
                f"{told}). It is damaged or of another format; export it again, or name the format."
            ) from error
    if not channels:
        raise InputError(f"{str(file)!r} ({name}) holds no channel of numbers. {' '.join(remarks)} Export it again.")
    return Measurement(file.stem, str(file), tuple(_distinct(channels, remarks)), tuple(remarks), name)


def formats() -> dict[str, ModuleType]:
    """The modules that read one format each, by name."""
    from twin.io import formats as package

    found = (one.name for one in pkgutil.iter_modules(package.__path__) if not one.name.startswith("_"))
    return {name: importlib.import_module(f"{package.__name__}.{name}") for name in sorted(found)}


def options_of(reader: ModuleType) -> dict[str, inspect.Parameter]:
    """The options of a format's reader: its keyword arguments.

    Args:
        reader: one of `formats()`.
    """
    parameters = inspect.signature(reader.read).parameters
    return {name: one for name, one in parameters.items() if one.kind is inspect.Parameter.KEYWORD_ONLY}


def listed(wanted: str, names: tuple[str, ...], most: int = 12) -> str:
    """Names for a message, those closest to the one wanted first.

    Args:
        wanted: what was asked for.
        names: what there is.
        most: how many are listed at most.
    """
    lowered = {name.lower(): name for name in reversed(names)}
    close = [lowered[name] for name in difflib.get_close_matches(wanted.lower(), lowered, n=3, cutoff=0.4)]
    ordered = list(dict.fromkeys([*close, *names]))
    more = f" and {len(ordered) - most} more" if len(ordered) > most else ""
    return ", ".join(map(repr, ordered[:most])) + more if ordered else "none"


def _check_options(name: str, reader: ModuleType, options: dict[str, Any]) -> None:
    known = tuple(options_of(reader))
    for option in options:
        if option not in known:
            raise InputError(f"format {name!r} has no option {option!r}; it has {listed(option, known)}. Correct it.")


def _found_format(file: Path, offered: dict[str, ModuleType]) -> str:
    with file.open("rb") as opened:
        head = opened.read(_HEAD)
    certain = {name: reader.matches(head) for name, reader in offered.items()}
    best = max(certain.values())
    by_ending = [name for name, reader in offered.items() if file.suffix.lower() in reader.ENDINGS]
    fitting = [name for name, one in certain.items() if one == best and best > 0]
    for name in (*(one for one in by_ending if one in fitting), *fitting, *by_ending):
        return name
    endings = " ".join(ending for reader in offered.values() for ending in reader.ENDINGS)
    raise InputError(
        f"{str(file)!r} is of no known format: it is no text and starts with {head[:8]!r}. Files of these endings are "
        f"read: {endings}. Export it as one of them, or name the format."
    )


def _distinct(channels: list[MeasuredChannel], remarks: list[str]) -> Iterator[MeasuredChannel]:
    seen: dict[str, int] = {}
    for channel in channels:
        count = seen[channel.name] = seen.get(channel.name, 0) + 1
        if count == 1:
            yield channel
            continue
        name = f"{channel.name} #{count}"
        remarks.append(f"There are {count} channels {channel.name!r}; this one is called {name!r}.")
        yield MeasuredChannel(name, channel.values, channel.unit, channel.times, channel.abscissa)
