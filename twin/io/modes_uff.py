"""Measured modes as a universal file: one dataset 55 for each mode."""

import os
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from twin._checks import InputError
from twin.modal.reference import ReferenceModes
from twin.structure import DIRECTIONS


def write_modes_uff(
    path: str | os.PathLike[str], modes: ReferenceModes, *, mass_normalised: bool = False, notes: Sequence[str] = ()
) -> Path:
    """Write modes to a universal file (dataset 55, data at nodes), ASCII, in SI units.

    Real shapes are written as normal modes with their damping ratio, and unit modal mass if they are mass-normalised;
    complex shapes as complex modes with their eigenvalues. Rows are named "node direction", as "12 x"; nodes whose
    names are no numbers are numbered in the order of the rows, from 1, and listed in the header of each mode. A
    direction that was not measured is zero. The format keeps six digits; the header has more of frequency and damping.

    Args:
        path: the file; one that exists is replaced.
        modes: the modes.
        mass_normalised: whether real shapes have unit modal mass.
        notes: up to two lines for the header of each mode, such as where the modes come from; cut at 80 letters.

    Returns:
        Path of the file.

    Raises:
        InputError: a row that is not named by node and direction, complex shapes with rotations, which the format's
            writer does not have, a folder that does not exist.
    """
    import pyuff  # a second to import

    file = Path(path)
    if not file.resolve().parent.is_dir():
        raise InputError(f"The folder of {str(file)!r} does not exist. Create it first, or correct the path.")
    places = [_place(name) for name in modes.outputs]
    nodes = list(dict.fromkeys(node for node, _ in places))
    numbers = _numbers(nodes)
    shapes = np.asarray(modes.output_shapes)
    turning = any(direction > 2 for _, direction in places)
    whole = np.iscomplexobj(shapes)
    if whole and turning:
        raise InputError("Complex shapes with rotations cannot be written. Write the real ones, or translations only.")
    kind = {"analysis_type": 3 if whole else 2, "data_ch": 3 if turning else 2, "spec_data_type": 8}
    rest = {"type": 55, "model_type": 1, "load_case": 0, "node_nums": np.array([numbers[node] for node in nodes])}
    sets = []
    for i, (frequency, ratio) in enumerate(
        zip(np.asarray(modes.frequency), np.asarray(modes.damping_ratio), strict=True)
    ):
        table = np.zeros((len(nodes), 6 if turning else 3), dtype=shapes.dtype)
        for (node, direction), value in zip(places, shapes[:, i], strict=True):
            table[nodes.index(node), direction] = value
        one = {**rest, **kind, "mode_n": i + 1, "id1": f"mode {i + 1}: {frequency:.10g} Hz, damping ratio {ratio:.8g}"}
        one |= {f"id{k}": note[:80] for k, note in enumerate(notes[:2], start=2) if note}
        one |= {f"r{k + 1}": table[:, k] for k in range(table.shape[1])}
        if whole:
            omega = 2 * np.pi * frequency
            one["eig"] = complex(-ratio * omega, omega * np.sqrt(1 - ratio**2))
        else:
            one |= {"freq": float(frequency), "modal_m": 1.0 if mass_normalised else 0.0}
            one |= {"modal_damp_vis": float(ratio), "modal_damp_his": 0.0}
        renamed = ", ".join(f"{numbers[node]}={node}" for node in nodes if str(numbers[node]) != node)
        sets.append({**one, "id4": renamed[:80] or "NONE"})
    file.unlink(missing_ok=True)
    pyuff.UFF(str(file)).write_sets(sets, "overwrite")
    return file


def _place(name: str) -> tuple[str, int]:
    node, _, direction = name.rpartition(" ")
    if not node or direction not in DIRECTIONS:
        raise InputError(
            f"The row {name!r} is not named by node and direction, as '12 x' or 'N6 rz'. Rename the outputs first."
        )
    return node, DIRECTIONS.index(direction)


def _numbers(nodes: list[str]) -> dict[str, int]:
    if all(re.fullmatch(r"[0-9]{1,9}", node) for node in nodes):
        return {node: int(node) for node in nodes}
    return {node: i for i, node in enumerate(nodes, start=1)}
