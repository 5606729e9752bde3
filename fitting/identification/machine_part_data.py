"""What each run of a small problem is solved with: the machine in the modes of one set of stiffnesses."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from fitting.identification.machine_affine import AffineMachine
from fitting.identification.machine_evidence import Evidence

# Weight of the strain energy where a reference shape is expanded to unmeasured coordinates.
_STRAIN = 1e-6


class PartProblem(NamedTuple):
    """One reference mode and the stiffnesses that are searched for it."""

    part: AffineMachine
    """The machine at the position of the mode."""
    reference: Evidence
    """The reference modes there."""
    mode: int
    """Number of the mode among these."""
    searched: Bool[np.ndarray, "stiffnesses"]
    """Which stiffnesses are searched."""
    bounds: Float[np.ndarray, "stiffnesses 2"]
    """Bounds of all stiffnesses [N/m, Nm/rad]."""
    rows: int
    """Rows for the places of the searched springs, padding counted."""
    size: int
    """Parameters, padding counted."""


def data_from_start(problem: PartProblem, values: Float[np.ndarray, "runs stiffnesses"]) -> tuple[np.ndarray, ...]:
    """What `PartData` holds, for runs from anywhere: modes for the middle of the bounds, begun at the reference.

    Args:
        problem: the problem.
        values: stiffnesses of each run; those that are searched do not matter.
    """
    part, one, mode = problem.part, problem.reference, problem.mode
    middle = np.where(problem.searched, problem.bounds.mean(axis=1), values)
    eigenvalues, basis = np.linalg.eigh(part.stiffness_matrices(middle))
    gram = part.output_map.T @ part.output_map
    cross = part.output_map.T @ one.shapes[:, mode]
    strain = part.stiffness_matrices(problem.bounds.mean(axis=1)[None])[0] / one.omega[mode] ** 2
    expanded = np.linalg.solve(gram + _STRAIN * np.trace(gram) / len(gram) * strain, cross)
    near = np.full(len(values), one.omega[mode] ** 2)
    return _data(problem, middle, eigenvalues, basis, np.swapaxes(basis, 1, 2) @ expanded, near)


def data_from_mode(problem: PartProblem, values: Float[np.ndarray, "runs stiffnesses"]) -> tuple[np.ndarray, ...]:
    """What `PartData` holds, for runs that begin exactly on the mode that is most alike.

    Args:
        problem: the problem.
        values: stiffnesses that each run begins with; the modes are those for these.
    """
    part, mode = problem.part, problem.mode
    eigenvalues, basis = np.linalg.eigh(part.stiffness_matrices(values))
    alike = problem.reference.only(mode).alike(eigenvalues, basis, part.output_map)[..., 0]
    start = np.eye(len(part.fixed))[alike.argmax(axis=1)]
    return _data(problem, values, eigenvalues, basis, start, np.full(len(values), np.nan))


def _data(
    problem: PartProblem,
    values: np.ndarray,
    eigenvalues: np.ndarray,
    basis: np.ndarray,
    start: np.ndarray,
    near: np.ndarray,
) -> tuple[np.ndarray, ...]:
    part, one, mode, searched, bounds, rows, _ = problem
    runs, width = len(values), bounds[:, 1] - bounds[:, 0]
    gram, cross = part.output_map.T @ part.output_map, part.output_map.T @ one.shapes[:, mode]
    places = np.flatnonzero(searched[part.spring_of])
    vectors = np.zeros((runs, len(part.fixed), rows))
    vectors[:, :, : places.size] = np.swapaxes(basis, 1, 2) @ part.springs[:, places]
    weight, owner = np.zeros(rows), np.zeros(rows, dtype=int)
    weight[: places.size] = width[part.spring_of[places]]
    owner[: places.size] = (np.cumsum(searched) - 1)[part.spring_of[places]]
    return (
        eigenvalues,
        vectors,
        np.tile(weight, (runs, 1)),
        np.tile(owner, (runs, 1)),
        shares_of(problem, values),
        np.swapaxes(basis, 1, 2) @ (gram @ basis),
        np.swapaxes(basis, 1, 2) @ cross,
        start,
        near,
        np.full(runs, one.omega[mode]),
        np.full(runs, one.ratio[mode]),
    )


def shares_of(
    problem: PartProblem, values: Float[np.ndarray, "runs stiffnesses"]
) -> Float[np.ndarray, "runs parameters"]:
    """Searched stiffnesses as shares of the way from their lower to their upper bound; a half for padding.

    Args:
        problem: the problem.
        values: all stiffnesses of each run [N/m, Nm/rad].
    """
    low, high = problem.bounds[problem.searched].T
    shares = np.full((len(values), problem.size), 0.5)
    shares[:, : low.size] = np.clip((values[:, problem.searched] - low) / (high - low), 0.0, 1.0)
    return shares
