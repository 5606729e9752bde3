"""Components from universal files: nodes (dataset 15), normal modes (dataset 55), units (dataset 164)."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from twin._checks import InputError
from twin.io._uff import read_sets, unit_factors
from twin.io.component import si_scales
from twin.structure import DIRECTIONS, Component, component_from_modes

_NORMAL_MODE = 2
_IMAGINARY = 1e-6


def read_component_uff(
    path: str | os.PathLike[str],
    *,
    names: Mapping[int, str] | None = None,
    modes: int | None = None,
    length_unit: str | None = None,
    mass_unit: str | None = None,
    loss_factor: float = 0.0,
) -> Component:
    """Read the normal modes of a free body from a universal file.

    Shapes are scaled to unit modal mass by the modal mass that each mode carries. Shapes of three values a node have no
    rotations; a joint that acts in one is refused.

    Args:
        path: the file, ASCII.
        names: names of the nodes wanted by their number in the file; None takes all, named "1", "2", ...
        modes: how many modes to keep, lowest first; None for all.
        length_unit: unit of length of the file; None takes dataset 164, and m where there is none.
        mass_unit: unit of its modal masses; None takes dataset 164, and kg where there is none.
        loss_factor: material damping η [-].

    Returns:
        The component, in SI.

    Raises:
        InputError: a file that cannot be read, no nodes or no normal modes in it, a node without shape or coordinates,
            complex shapes, modal masses that are not positive, fewer modes than asked.
    """
    sets, file = read_sets(path)
    length, force = unit_factors(sets)
    own_length, scales = si_scales(length_unit or "m", mass_unit or "kg")
    own_length = own_length if length_unit else 1 / length
    # Mass is force over acceleration, in the file's units: kg = (force / force factor) / (length / length factor).
    mass = 1.0 if mass_unit else length / force
    scales = np.repeat([1.0, 1.0 / own_length], 3) / np.sqrt(mass) * scales[0]

    places: dict[int, np.ndarray] = {}
    for one in (one for one in sets if one["type"] in (15, 2411)):
        if len(set(np.asarray(one.get("disp_cs", 0)).ravel().tolist())) > 1:
            raise InputError(
                f"The nodes of {str(file)!r} have different coordinate systems for displacements. Export the shapes in "
                "one, the global one."
            )
        coordinates = np.stack([np.asarray(one[axis], dtype=np.float64) for axis in "xyz"], axis=1)
        numbers = one["node_nums"] if one["type"] == 15 else one["grid_global"]
        places |= {int(number): where for number, where in zip(numbers, coordinates, strict=True)}
    found = [one for one in sets if one["type"] == 55 and int(one["analysis_type"]) == _NORMAL_MODE]
    if not found or not places:
        what = "normal modes (dataset 55, analysis type 2)" if places else "nodes (dataset 15)"
        raise InputError(f"Universal file {str(file)!r} holds no {what}. Export nodes and normal modes together.")
    chosen = dict(names) if names is not None else {number: str(number) for number in places}
    columns = [_shape(one, chosen, file) for one in found]
    count = min(column.shape[1] for column in columns)
    for number in chosen:
        if number not in places:
            raise InputError(f"Universal file {str(file)!r} has no coordinates of node {number}. Leave the node out.")
    return component_from_modes(
        np.asarray([float(one["freq"]) for one in found]),
        np.stack([column[:, :count] for column in columns], axis=-1) * scales[:count, None],
        tuple(chosen.values()),
        np.stack([places[number] for number in chosen]) * own_length,
        directions=DIRECTIONS[:count],
        modal_mass=np.asarray([float(one["modal_m"]) for one in found]),
        modes=modes,
        loss_factor=loss_factor,
    )


def _shape(one: dict[str, Any], chosen: Mapping[int, str], file: Path) -> np.ndarray:
    """One mode's shape at the nodes chosen, (nodes, 3 or 6)."""
    mode = f"mode {one.get('mode_n', '?')} of {str(file)!r}"
    values = np.stack([np.asarray(one[f"r{i}"], dtype=complex) for i in range(1, 7) if f"r{i}" in one], axis=1)
    if values.shape[1] not in (3, 6):
        raise InputError(f"The shape of {mode} has {values.shape[1]} values a node, but three or six are expected.")
    if np.max(np.abs(np.imag(values))) > _IMAGINARY * np.max(np.abs(values)):
        raise InputError(f"The shape of {mode} is complex. A component takes the real modes of the undamped body.")
    rows = {int(number): i for i, number in enumerate(one["node_nums"])}
    for number in chosen:
        if number not in rows:
            raise InputError(f"The shape of {mode} has no node {number}. Leave the node out, or export all its modes.")
    return np.real(values[[rows[number] for number in chosen]])
