"""Components from files of named arrays: NPZ and MAT."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from twin._checks import InputError
from twin.io._files import existing_file
from twin.io.units import to_si
from twin.structure import DIRECTIONS, Component, component_from_modes

_NEEDED = ("frequency", "shapes", "nodes", "positions")


def read_component_npz(
    path: str | os.PathLike[str],
    *,
    names: Mapping[str, str] | None = None,
    modes: int | None = None,
    length_unit: str = "m",
    mass_unit: str = "kg",
) -> Component:
    """Read the modes of a free body from a NumPy archive of plain arrays (nothing is unpickled).

    The arrays: `frequency` (modes,) [Hz]; `shapes` (nodes, directions, modes), mass-normalised unless there is
    `modal_mass` (modes,); `nodes`, the names; `positions` (nodes, 3). May be there: `directions`, the names of the
    shapes' second axis (without it x, y, z, or all six); `loss_factor`; and for each rail
    `rail_<name>_coordinate` (points,) and `rail_<name>_shapes` (points, directions, modes).

    Args:
        path: the file.
        names: what an array is called in the file, where it is another name: `{"frequency": "f_n"}`.
        modes: how many modes to keep, lowest first; None for all.
        length_unit: unit of positions and coordinates, and of the shapes' rotations: mm for a model in t, mm, s.
        mass_unit: unit of the modal masses, and of the mass-normalised shapes.

    Returns:
        The component, in SI.

    Raises:
        InputError: a file that cannot be read, a missing array, fewer modes than asked, arrays that do not fit.
    """
    file = existing_file(path, "NPZ file")
    try:
        with np.load(file, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except Exception as error:  # a damaged archive makes NumPy raise nearly anything
        raise InputError(
            f"NPZ file {str(file)!r} cannot be read ({type(error).__name__}: {error}). Save it by numpy.savez with "
            "plain arrays: numbers, and names as text, not as objects."
        ) from error
    return _component(file, arrays, names or {}, modes, length_unit, mass_unit)


def read_component_mat(
    path: str | os.PathLike[str],
    *,
    names: Mapping[str, str] | None = None,
    modes: int | None = None,
    length_unit: str = "m",
    mass_unit: str = "kg",
) -> Component:
    """Read the modes of a free body from a MAT-file, version 4 to 7.

    The variables are those of `read_component_npz`; names are a cell array of text, or rows of characters.

    Args:
        path: the file.
        names: what a variable is called in the file, where it is another name.
        modes: how many modes to keep, lowest first; None for all.
        length_unit: unit of positions and coordinates, and of the shapes' rotations.
        mass_unit: unit of the modal masses, and of the mass-normalised shapes.

    Returns:
        The component, in SI.

    Raises:
        InputError: a file that cannot be read, a missing variable, fewer modes than asked, arrays that do not fit.
    """
    import scipy.io  # a quarter of a second to import

    file = existing_file(path, "MAT-file")
    try:
        variables = scipy.io.loadmat(file, appendmat=False, chars_as_strings=True)
    except NotImplementedError as error:
        raise InputError(
            f"MAT-file {str(file)!r} has version 7.3 (HDF5), which cannot be read yet. "
            "Save it again in MATLAB with save(..., '-v7')."
        ) from error
    except Exception as error:  # a damaged file makes SciPy raise nearly anything
        raise InputError(
            f"MAT-file {str(file)!r} cannot be read ({type(error).__name__}: {error}): it is truncated, damaged or no "
            "MAT-file. Export it again."
        ) from error
    arrays = {name: value for name, value in variables.items() if not name.startswith("__")}
    return _component(file, arrays, names or {}, modes, length_unit, mass_unit)


def si_scales(length_unit: str, mass_unit: str) -> tuple[float, np.ndarray]:
    """What to multiply lengths and mass-normalised shapes with, for SI.

    Args:
        length_unit: unit of length of a model, such as "mm".
        mass_unit: its unit of mass, such as "t".

    Returns:
        The factor of lengths, and that of shapes in each of the six directions.
    """
    length = float(to_si(1.0, length_unit, "m", name="length_unit"))
    mass = float(to_si(1.0, mass_unit, "kg", name="mass_unit"))
    return length, np.repeat([1.0, 1.0 / length], 3) / np.sqrt(mass)


def _component(
    file: Path,
    arrays: dict[str, np.ndarray],
    names: Mapping[str, str],
    modes: int | None,
    length_unit: str,
    mass_unit: str,
) -> Component:
    def array(name: str) -> np.ndarray:
        stored = names.get(name, name)
        if stored not in arrays:
            raise InputError(
                f"{str(file)!r} has no array {stored!r}; it has {', '.join(sorted(arrays)) or 'none'}. Add it, or say "
                f"by names={{{name!r}: ...}} what it is called."
            )
        return arrays[stored]

    def numbers(name: str) -> np.ndarray:
        value = array(name)
        if value.dtype.kind not in "biuf":
            raise InputError(
                f"{name} of {str(file)!r} must hold real numbers, but holds {value.dtype}. Export it again."
            )
        return value.astype(np.float64)

    frequency, nodes = numbers("frequency").ravel(), _texts(array("nodes"))
    shapes = _with_modes_last(numbers("shapes"), frequency.size)
    count = shapes.shape[1] if shapes.ndim == 3 else 6
    given = names.get("directions", "directions") in arrays
    directions = _texts(array("directions")) if given else DIRECTIONS[:3] if count == 3 else DIRECTIONS
    length, scales = si_scales(length_unit, mass_unit)
    for direction in directions:
        if direction not in DIRECTIONS:
            raise InputError(f"directions of {str(file)!r} must be among {', '.join(DIRECTIONS)}, not {direction!r}.")
    factor = scales[[DIRECTIONS.index(direction) for direction in directions]][:, None]
    if shapes.ndim != 3 or shapes.shape[1] != len(directions):
        raise InputError(
            f"shapes of {str(file)!r} must be (nodes, {len(directions)} directions, modes), but have the shape "
            f"{shapes.shape}. Save three axes, and name the directions if they are neither three nor six."
        )
    rails = {}
    for stored in sorted(arrays):
        if stored.startswith("rail_") and stored.endswith("_coordinate"):
            name = stored.removeprefix("rail_").removesuffix("_coordinate")
            on_rail = _with_modes_last(numbers(f"rail_{name}_shapes"), frequency.size)
            if on_rail.ndim != 3 or on_rail.shape[1] != len(directions):
                raise InputError(
                    f"rail_{name}_shapes of {str(file)!r} must be (points, {len(directions)} directions, modes), but "
                    f"has the shape {on_rail.shape}."
                )
            rails[name] = (numbers(stored).ravel() * length, on_rail * factor)
    has_mass = names.get("modal_mass", "modal_mass") in arrays
    has_loss = names.get("loss_factor", "loss_factor") in arrays
    return component_from_modes(
        frequency,
        shapes * factor,
        nodes,
        numbers("positions").reshape(-1, 3) * length,
        directions=directions,
        modal_mass=numbers("modal_mass").ravel() if has_mass else None,
        modes=modes,
        loss_factor=float(numbers("loss_factor").ravel()[0]) if has_loss else 0.0,
        rails=rails,
    )


def _with_modes_last(shapes: np.ndarray, modes: int) -> np.ndarray:
    # MATLAB drops a last axis of length one.
    return shapes[..., None] if shapes.ndim == 2 and modes == 1 else shapes


def _texts(value: Any) -> tuple[str, ...]:
    flat = np.asarray(value).ravel()
    return tuple(str(np.asarray(text).ravel()[0]).strip() if np.size(text) else "" for text in flat)
