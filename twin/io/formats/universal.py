"""Universal files: functions at nodes (dataset 58), over time or frequency, as text or binary."""

import re
from pathlib import Path
from typing import Any

import numpy as np

from twin._checks import InputError
from twin.io._uff import check_whole
from twin.io.formats._shared import check_count, check_room, printable
from twin.io.measurement import MeasuredChannel

ENDINGS = (".uff", ".unv", ".uf", ".58", ".bunv")
_MARK = b"    -1"
_TIME, _FREQUENCY = 17, 18
_SPECTRA = frozenset({2, 3, 4, 5, 6, 7, 8, 9, 12})
_KINDS = {1: "time", 2: "auto spectrum", 3: "cross spectrum", 4: "FRF", 6: "coherence", 9: "PSD", 12: "spectrum"}
_UNITS = {8: "m", 9: "N", 11: "m/s", 12: "m/s^2", 13: "N", 15: "Pa", 5: "degC"}
_DIRECTIONS = ("", "x", "y", "z", "rx", "ry", "rz")


def matches(head: bytes) -> int:
    """Whether these first bytes are those of a universal file."""
    return 2 if re.match(rb"\s*?    -1\s*[\r\n]+ {0,6}\d{1,6}", head) else 0


def read(file: Path, limit: int, *, units: dict[int, str] | None = None) -> tuple[list[MeasuredChannel], list[str]]:
    """Read the functions of datasets 58 and 58b; they are named "response" or "response/reference".

    Normal modes (dataset 55) make a component, by `twin.io.component_uff.read_component_uff`.

    Args:
        file: the file.
        limit: bytes that may be read.
        units: units by data type, such as {8: "mm"}, where the file has no labels of units; None takes SI.

    Raises:
        InputError: a file that is damaged or cut, or has no function in it.
    """
    import pyuff  # a second to import

    check_room(file.stat().st_size, limit, file, "the file itself")
    check_whole(file)
    uff = pyuff.UFF(str(file))
    kinds = [int(kind) for kind in uff.get_set_types()]
    check_count(len(kinds), file)
    functions = [i for i, kind in enumerate(kinds) if kind == 58]
    others = sorted({kind for kind in kinds if kind != 58})
    remarks = [f"Datasets of type {', '.join(map(str, others))} are left out."] if others else []
    if 55 in others:
        remarks.append("Normal modes (dataset 55) make a component of a machine; read them as such.")
    if not functions:
        raise InputError(
            f"Universal file {str(file)!r} holds no function at nodes (dataset 58), but datasets of type "
            f"{', '.join(map(str, others)) or 'none'}. {' '.join(remarks[1:])} Export functions as dataset 58."
        )
    channels = []
    for i in functions:
        one = uff.read_sets(i)
        if not isinstance(one, dict) or "data" not in one or "x" not in one:
            raise InputError(f"Universal file {str(file)!r} has a damaged dataset {i + 1}. Export it again.")
        channels.append(_channel(one, i + 1, file, units or {}, remarks))
    if any(channel.abscissa == "frequency" for channel in channels):
        remarks.append("Frequency responses: drivetwin modes FILE finds their modes.")
    return channels, list(dict.fromkeys(remarks))


def _channel(
    one: dict[str, Any], number: int, file: Path, units: dict[int, str], remarks: list[str]
) -> MeasuredChannel:
    data, x = np.asarray(one["data"]).ravel(), np.asarray(one["x"], dtype=np.float64).ravel()
    declared = int(one.get("num_pts", data.size))
    # A binary block may end in a line feed that looks like part of a number, and never in less than it declares.
    if declared <= 0 or data.size < declared or x.size < declared:
        raise InputError(
            f"Universal file {str(file)!r} declares {declared} values in dataset {number} and holds {data.size}. It is "
            "cut short or damaged; export it again, binary data perhaps as text."
        )
    data, x = data[:declared], x[:declared]
    data = data.astype(np.complex128 if data.dtype.kind == "c" else np.float64)
    kind = int(one.get("func_type", 0))
    abscissa_type = int(one.get("abscissa_spec_data_type", 0))
    over_frequency = abscissa_type == _FREQUENCY or (abscissa_type != _TIME and kind in _SPECTRA)
    name = _place(one, "rsp")
    if kind in (3, 4, 5, 6):
        name = f"{name}/{_place(one, 'ref')}"
    if kind not in (1, 4):
        name = f"{_KINDS.get(kind, f'function {kind}')} {name}"
    unit = _unit(one, "ordinate", units, remarks)
    if kind == 4:
        below = _unit(one, "orddenom", units, remarks)
        unit = (
            f"{unit}/({below})" if unit and re.search(r"[^\w]", below) else f"{unit}/{below}" if unit and below else ""
        )
    if x.size > 1 and not np.any(np.diff(x)):
        remarks.append(f"{name!r} has no abscissa; its values are only counted.")
        return MeasuredChannel(name, data, unit)
    return MeasuredChannel(name, data, unit, x, "frequency" if over_frequency else "time")


def _place(one: dict[str, Any], end: str) -> str:
    entity = printable(one.get(f"{end}_ent_name", ""))
    node, direction = int(one.get(f"{end}_node", 0)), int(one.get(f"{end}_dir", 0))
    place = f"{node} {'-' * (direction < 0)}{_DIRECTIONS[abs(direction)] if abs(direction) < 7 else direction}".strip()
    return place if entity in ("", "NONE") else f"{entity} {place}"


def _unit(one: dict[str, Any], axis: str, units: dict[int, str], remarks: list[str]) -> str:
    kind = int(one.get(f"{axis}_spec_data_type", 0))
    label = printable(one.get(f"{axis}_axis_units_lab", ""))
    if kind in units:
        return units[kind]
    if label and label.upper() != "NONE":
        return label
    if kind in _UNITS:
        remarks.append("Units are not labelled; SI is assumed. Give others by the option units.")
    return _UNITS.get(kind, "")
