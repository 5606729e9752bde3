"""Measured frequency responses from universal files (dataset 58)."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np

from twin._checks import InputError
from twin.frf import FRF
from twin.io._uff import read_sets, unit_factors
from twin.io._whole_grid import largest_grid, missing
from twin.structure import DIRECTIONS

_FREQUENCY_RESPONSE = 4
_FORMS = {8: "receptance", 11: "mobility", 12: "accelerance"}
_FORCES = (9, 13)
_MOST_LISTED = 8


Found = dict[tuple[str, str], tuple[np.ndarray, np.ndarray]]
"""Frequencies and values by response and excitation."""


def read_frf_uff(
    path: str | os.PathLike[str],
    *,
    names: Mapping[int, str] | None = None,
    outputs: tuple[str, ...] | None = None,
    inputs: tuple[str, ...] | None = None,
) -> FRF:
    """Read the frequency response functions of a universal file.

    Responses and excitations are named "node direction" as those of a machine, "12 x" or "12 ry"; a response measured
    against a direction is turned round. Values are converted to SI by dataset 164 where the file has one.

    Args:
        path: the file.
        names: names of nodes by their number in the file; a node without keeps its number.
        outputs: responses wanted; None for all.
        inputs: excitations wanted; None for all.

    Returns:
        The response: receptance [m/N], mobility [m/(Ns)] or accelerance [m/(Ns²)], or its like in rotations.

    Raises:
        InputError: a file that cannot be read, no response function in it, one given twice or missing, functions of
            different form or frequencies, a quantity other than motion over force.
    """
    found, form, file, _ = _functions(path, names or {}, outputs, inputs)
    rows = tuple(dict.fromkeys(response for response, _ in found)) if outputs is None else outputs
    columns = tuple(dict.fromkeys(excitation for _, excitation in found)) if inputs is None else inputs
    for pair in ((row, column) for row in rows for column in columns):
        if pair not in found:
            raise InputError(
                f"Universal file {str(file)!r} has no response of {pair[0]!r} to {pair[1]!r}. Choose outputs and "
                "inputs that were all measured."
            )
    return _stacked(found, rows, columns, form)


def read_largest_frf_uff(path: str | os.PathLike[str]) -> tuple[FRF, list[str], str]:
    """Read the frequency response functions of a universal file; where some are missing, the largest whole grid.

    Args:
        path: the file.

    Returns:
        The response, as `read_frf_uff` gives it; remarks on what is missing and what was left out for it; name of the
        component, as the file has it.

    Raises:
        InputError: what `read_frf_uff` refuses, but missing functions.
    """
    found, form, _, components = _functions(path, {}, None, None)
    gaps = missing(found)
    rows, columns = largest_grid(found)
    remarks = []
    if gaps:
        listed = ", ".join(f"{row} / {column}" for row, column in gaps[:_MOST_LISTED])
        more = f" and {len(gaps) - _MOST_LISTED} more" if len(gaps) > _MOST_LISTED else ""
        left = [name for name in dict.fromkeys(row for row, _ in found) if name not in rows]
        unused = [name for name in dict.fromkeys(column for _, column in found) if name not in columns]
        without = " and ".join(
            f"{what} {', '.join(names)}" for what, names in (("response", left), ("excitation", unused)) if names
        )
        remarks.append(
            f"Not measured (response / excitation): {listed}{more}. The largest whole grid is used, {len(rows)} x "
            f"{len(columns)}, without {without}."
        )
    return _stacked(found, rows, columns, form), remarks, ", ".join(components)


def _functions(
    path: str | os.PathLike[str],
    names: Mapping[int, str],
    outputs: tuple[str, ...] | None,
    inputs: tuple[str, ...] | None,
) -> tuple[Found, str, Path, list[str]]:
    """Those wanted of the file, their form, the file, and the names of its components."""
    sets, file = read_sets(path)
    length, force = unit_factors(sets)
    functions = [one for one in sets if one["type"] == 58 and int(one["func_type"]) == _FREQUENCY_RESPONSE]
    found: Found = {}
    forms: dict[str, tuple[str, str]] = {}
    for one in functions:
        response, up, turning = _place(one, "rsp", names, file)
        excitation, along, moment = _place(one, "ref", names, file)
        wanted = (outputs is None or response in outputs) and (inputs is None or excitation in inputs)
        if not wanted:
            continue
        if (response, excitation) in found:
            raise InputError(
                f"Universal file {str(file)!r} has the response of {response!r} to {excitation!r} twice. Remove one."
            )
        forms.setdefault(_form(one, file), (response, excitation))
        values = np.asarray(one["data"])
        if values.size < int(one.get("num_pts", values.size)):
            raise InputError(
                f"Universal file {str(file)!r} declares {one['num_pts']} values of {response!r} to {excitation!r} and "
                f"holds {values.size}. It is cut short or damaged; export it again."
            )
        scale = up * along * force * (length if moment else 1.0) / (1.0 if turning else length)
        found[response, excitation] = (np.asarray(one["x"], dtype=np.float64), values * scale)
    if not found:
        raise InputError(f"Universal file {str(file)!r} holds no frequency response function (dataset 58, function 4).")
    if len(forms) > 1:
        listed = " and ".join(f"{form} ({pair[0]} / {pair[1]})" for form, pair in forms.items())
        raise InputError(f"Universal file {str(file)!r} mixes {listed}. Choose outputs and inputs of one form.")
    entities = (str(one.get(f"{end}_ent_name", "")).strip() for one in functions for end in ("rsp", "ref"))
    return found, next(iter(forms)), file, [name for name in dict.fromkeys(entities) if name not in ("", "NONE")]


def _stacked(found: Found, rows: tuple[str, ...], columns: tuple[str, ...], form: str) -> FRF:
    frequency = next(iter(found.values()))[0]
    for pair, (own, _) in found.items():
        if own.shape != frequency.shape or not np.allclose(own, frequency, rtol=1e-6):
            raise InputError(f"The response of {pair[0]!r} to {pair[1]!r} has other frequencies. Resample it first.")
    values = np.stack([np.stack([found[row, column][1] for column in columns]) for row in rows])
    return FRF(jnp.asarray(frequency), jnp.asarray(values, dtype=complex), rows, columns, form=form)


def _place(one: dict[str, Any], end: str, names: Mapping[int, str], file: Path) -> tuple[str, float, bool]:
    """Name "node direction", sign, and whether it is a rotation or moment."""
    node, direction = int(one[f"{end}_node"]), int(one[f"{end}_dir"])
    if not 1 <= abs(direction) <= 6:
        raise InputError(
            f"Universal file {str(file)!r} has the direction {direction} at node {node}, but 1 to 6 with a sign are "
            "expected. Name the directions of scalar channels before the export."
        )
    name = f"{names.get(node, str(node))} {DIRECTIONS[abs(direction) - 1]}"
    return name, float(np.sign(direction)), abs(direction) > 3


def _form(one: dict[str, Any], file: Path) -> str:
    motion, force = int(one["ordinate_spec_data_type"]), int(one["orddenom_spec_data_type"])
    if motion not in _FORMS or force not in _FORCES:
        raise InputError(
            f"Universal file {str(file)!r} has a response of data type {motion} over {force}, but displacement (8), "
            "velocity (11) or acceleration (12) over force (13) is expected. Export motion over force."
        )
    return _FORMS[motion]
