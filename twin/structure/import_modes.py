"""Components from what a user has: natural frequencies with shapes, or the matrices of a finite-element reduction."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import ArrayLike

from twin._checks import InputError, finite, not_negative, positive, require_x64
from twin.structure.component import Component
from twin.structure.directions import DIRECTIONS
from twin.structure.rail import Rail

# Static deflections that are combinations of others but for this share bring nothing new.
_DEPENDENT = 1e-8


def component_from_modes(
    frequency: ArrayLike | list | tuple,
    shapes: ArrayLike | list | tuple,
    nodes: Sequence[str],
    positions: ArrayLike | list | tuple,
    *,
    directions: Sequence[str] = DIRECTIONS,
    modal_mass: ArrayLike | list | tuple | None = None,
    modes: int | None = None,
    loss_factor: float = 0.0,
    rails: Mapping[str, tuple[Any, Any]] | None = None,
) -> Component:
    """A component from the modes of a free body, as a finite-element program or a modal analysis gives them.

    Rigid-body modes have frequency zero and belong to it: without them the component is held by nothing but errs in
    every static deflection.

    Args:
        frequency: natural frequencies (modes,) [Hz].
        shapes: shapes at the nodes (nodes, directions, modes), of any scale if modal masses are given, else
            mass-normalised [1/√kg, 1/(m√kg)].
        nodes: names of the nodes.
        positions: coordinates of the nodes (nodes, 3) [m].
        directions: directions that the shapes' second axis holds, such as ("x", "y", "z") without rotations.
        modal_mass: modal masses φᵀMφ (modes,) [kg]; None for 1 each.
        modes: how many modes to keep, lowest first; None for all.
        loss_factor: material damping η [-].
        rails: for each rail its coordinates (points,) [m] and shapes (points, directions, modes), scaled as `shapes`.

    Returns:
        The component; directions that are not given are zero, and refused to joints.

    Raises:
        InputError: fewer modes than asked, lengths that do not agree, unknown directions, modal masses that are not
            positive, negative or non-finite values.
    """
    require_x64()
    found = np.asarray(frequency, dtype=np.float64)
    if found.ndim != 1 or found.size == 0:
        raise InputError(f"frequency must be a vector of natural frequencies [Hz], but has the shape {found.shape}.")
    not_negative("frequency", found, "Hz")
    mass = np.ones_like(found) if modal_mass is None else np.asarray(modal_mass, dtype=np.float64)
    if mass.shape != found.shape:
        raise InputError(f"modal_mass must have one entry for each of the {found.size} modes, but has {mass.shape}.")
    positive("modal_mass", mass, "kg")
    if modes is not None and not 1 <= modes <= found.size:
        raise InputError(
            f"modes is {modes}, but the model has {found.size}. Ask for at most as many, or compute more of them."
        )
    kept = np.argsort(found, kind="stable")[:modes]

    def scaled(name: str, values: Any, count: int) -> np.ndarray:
        array = np.asarray(values, dtype=np.float64)
        expected = (count, len(directions), found.size)
        if array.shape != expected:
            raise InputError(
                f"{name} must have the shape {expected} (places, directions {', '.join(directions)}, modes), but has "
                f"{array.shape}. Check that frequencies, shapes and names come from the same model."
            )
        finite(name, array)
        full = np.zeros((count, 6, kept.size))
        full[:, [_number(direction) for direction in directions]] = (array / np.sqrt(mass))[..., kept]
        return full

    return Component(
        (2 * np.pi * found[kept]) ** 2,
        scaled("shapes", shapes, len(nodes)),
        np.asarray(positions, dtype=np.float64),
        tuple(nodes),
        loss_factor=loss_factor,
        rails={
            name: Rail(coordinate, scaled(f"shapes of rail {name!r}", values, np.size(coordinate)))
            for name, (coordinate, values) in (rails or {}).items()
        },
        directions=tuple(directions),
    )


def component_modes(
    mass: Any,
    stiffness: Any,
    nodes: Sequence[str],
    positions: ArrayLike | list | tuple,
    dofs: Any,
    *,
    below: float,
    interfaces: Any = None,
    rigid_below: float = 1.0,
    directions: Sequence[str] = DIRECTIONS,
    loss_factor: float = 0.0,
    rails: Mapping[str, tuple[Any, Any]] | None = None,
) -> Component:
    """A component from the matrices of a free body: all rigid-body modes, and the elastic ones below a frequency.

    The modes left out make the body too stiff where joints act, which matters where joints are stiff. With `interfaces`
    their static share is kept: to the modes come the body's static deflections under a unit load at each of these rows,
    as far as the modes lack them, made into further shapes with eigenvalues of their own.

    Args:
        mass: M, symmetric and positive definite (n, n) [kg].
        stiffness: K, symmetric, of the body without supports (n, n) [N/m].
        nodes: names of the nodes wanted.
        positions: their coordinates (nodes, 3) [m].
        dofs: which row of the matrices each node and direction is (nodes, directions), integers.
        below: modes below this frequency are kept [Hz]. Two to three times the highest frequency of interest is
            customary for a free-interface model.
        interfaces: rows of the matrices at which the flexibility shall be exact at rest, integers of any shape; None
            for the modes alone.
        rigid_below: a mode below this frequency is a rigid-body mode, to which rounding gave a frequency [Hz].
        directions: directions that the second axis of `dofs` holds.
        loss_factor: material damping η [-].
        rails: for each rail its coordinates (points,) [m] and rows of the matrices (points, directions).

    Returns:
        The component.

    Raises:
        InputError: matrices that are not square, symmetric, finite or (M) positive definite, rows outside of them, a
            body that is not free of negative stiffness, no mode below the frequency.

    Source: R. R. Craig, A. J. Kurdila, "Fundamentals of Structural Dynamics", 2nd ed. 2006, ch. 17 (free-interface
    modes); R. H. MacNeal, "A hybrid method of component mode synthesis", Computers & Structures 1 (1971) 581-601
    (residual flexibility).
    """
    import scipy.linalg

    m, k = _matrix("mass", mass), _matrix("stiffness", stiffness)
    if m.shape != k.shape:
        raise InputError(
            f"mass {m.shape} and stiffness {k.shape} must be of one size. Check that they belong together."
        )
    positive("below", below, "Hz")
    top = (2 * np.pi * below) ** 2
    try:
        values, vectors = scipy.linalg.eigh(k, m, subset_by_value=(-np.inf, top))
    except np.linalg.LinAlgError as error:
        raise InputError(
            "mass is not positive definite: every degree of freedom needs a mass. Remove those without one by static "
            "condensation."
        ) from error
    rigid = np.abs(values) < (2 * np.pi * rigid_below) ** 2
    if values.size == 0 or np.any(values[~rigid] < 0):
        raise InputError(
            f"The lowest eigenvalue is {values[0]:g} 1/s², which no elastic body has. Check the sign of K."
            if values.size
            else f"The body has no mode below {below:g} Hz. Raise the frequency; a free body has rigid-body modes."
        )

    values = np.where(rigid, 0.0, values)
    if interfaces is not None:
        loaded = _rows("interfaces", np.asarray(interfaces).ravel(), m.shape[0])
        extra_values, extra = _residual_modes(m, k, vectors, vectors[:, rigid], loaded)
        values, vectors = np.concatenate([values, extra_values]), np.concatenate([vectors, extra], axis=1)

    def at(name: str, rows: Any) -> np.ndarray:
        index = _rows(name, rows, m.shape[0])
        if index.ndim != 2 or index.shape[1] != len(directions):
            raise InputError(
                f"{name} must have the shape (places, {len(directions)} directions), but has {index.shape}. Give each "
                "place a row for each direction."
            )
        return vectors[index]

    return component_from_modes(
        np.sqrt(values) / (2 * np.pi),
        at("dofs", dofs),
        nodes,
        positions,
        directions=directions,
        loss_factor=loss_factor,
        rails={name: (where, at(f"rows of rail {name!r}", rows)) for name, (where, rows) in (rails or {}).items()},
    )


def _matrix(name: str, value: Any) -> np.ndarray:
    array = np.asarray(value.toarray() if hasattr(value, "toarray") else value, dtype=np.float64)
    if array.ndim != 2 or array.shape[0] != array.shape[1] or array.size == 0:
        raise InputError(f"{name} must be a square matrix, but has the shape {array.shape}.")
    finite(name, array)
    if np.max(np.abs(array - array.T)) > 1e-9 * np.max(np.abs(array)):
        raise InputError(f"{name} must be symmetric, but is not. Use the matrix of the whole body, both halves filled.")
    return (array + array.T) / 2


def _rows(name: str, rows: Any, size: int) -> np.ndarray:
    index = np.asarray(rows)
    if index.dtype.kind not in "iu" or (index.size and not (index.min() >= 0 and index.max() < size)):
        raise InputError(
            f"{name} must hold rows of the matrices, integers from 0 to {size - 1}, but holds {index.dtype} from "
            f"{np.min(index, initial=0):g} to {np.max(index, initial=0):g}. Check the numbering."
        )
    return index


def _residual_modes(
    mass: np.ndarray, stiffness: np.ndarray, kept: np.ndarray, rigid: np.ndarray, loaded: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues and mass-normalised shapes in the space of the static deflections that the kept modes lack."""
    import scipy.linalg

    loads = -(mass @ kept) @ kept[loaded].T
    loads[loaded, np.arange(loaded.size)] += 1.0
    # These loads move no rigid-body mode; holding those makes K regular and changes nothing else.
    held = mass @ rigid
    scale = np.trace(stiffness) / max(np.sum(held**2), 1e-300)
    deflections = scipy.linalg.solve(stiffness + scale * held @ held.T, loads, assume_a="pos")
    deflections -= kept @ (kept.T @ (mass @ deflections))
    small = deflections.T @ mass @ deflections
    size = np.sqrt(np.diag(small))
    share, basis = np.linalg.eigh(small / np.outer(size, size))
    own = share > _DEPENDENT
    deflections = deflections / size @ basis[:, own] / np.sqrt(share[own])
    values, turn = scipy.linalg.eigh(deflections.T @ stiffness @ deflections)
    return values, deflections @ turn


def _number(direction: str) -> int:
    if direction not in DIRECTIONS:
        raise InputError(f"directions must be among {', '.join(DIRECTIONS)}, but one is {direction!r}.")
    return DIRECTIONS.index(direction)
