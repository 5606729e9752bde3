"""One small problem per reference mode: the few springs that move it, searched from many random starts.

Source: section 2.3.2 of J. Ellinger, M. F. Zaeh, Machines 10 (2022) 535.
"""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool

from fitting.identification.machine_affine import AffineMachine, affine_machine
from fitting.identification.machine_evidence import Evidence, evidence
from fitting.identification.machine_likeness import PartData, Shares, Unlikeness
from fitting.identification.machine_part_runs import PartRuns, best_macxp
from fitting.lanes import Task, solve_lanes
from fitting.objective import Objective
from fitting.shared_out import shared_out
from fitting.solvers.slsqp import SLSQP
from twin._checks import InputError
from twin.modal.reference import ReferenceModes
from twin.parameters import Parameter, ParameterSpace
from twin.structure import Machine

# Problems are filled up to one of these numbers of parameters: each is a program to compile.
_SIZES = (3, 5, 9, 16)
# Weight of the strain energy where a reference shape is expanded to unmeasured coordinates.
_STRAIN = 1e-6
_CHUNK = 100


def solve_parts(
    machine: Machine,
    references: Sequence[ReferenceModes],
    positions: Sequence[float],
    space: ParameterSpace,
    searched: Bool[np.ndarray, "problems parameters"],
    *,
    seed: int,
    starts: int = 100,
    max_steps: int = 100,
    solver: SLSQP | None = None,
    threads: int | None = None,
) -> PartRuns:
    """Search, for each reference mode, the springs that move it for the greatest MACXP, from many random starts.

    Args:
        machine: machine; its values of the unknown parameters play no part.
        references: reference modes, one set for each position.
        positions: axis positions [m].
        space: unknown stiffnesses and dampings of joints, with bounds.
        searched: which parameters are searched for each reference mode, position by position, as
            `MachineSensitivity.searched` says; dampings are never searched, as they turn no shape.
        seed: seed of the starts, and of the values that the other stiffnesses are held at.
        starts: runs of each problem.
        max_steps: steps after which a run is given up.
        solver: SLSQP with its settings.
        threads: runs side by side; the number of cores if not given.

    Returns:
        All runs, each checked against all modes of the machine.

    Raises:
        InputError: 64-bit mode off, a parameter that is no stiffness or damping of a joint, reference data that cannot
            be compared, a mask of another shape, fewer than two starts.
    """
    data = evidence(references, positions)
    parts = [affine_machine(machine, space, one.position, one.outputs) for one in data]
    count = sum(one.omega.size for one in data)
    mask = np.asarray(searched, dtype=bool)
    if mask.shape != (count, len(space)):
        raise InputError(
            f"searched has shape {mask.shape}, but there are {count} reference modes and {len(space)} parameters."
        )
    if starts < 2:
        raise InputError(f"starts must be at least 2, but is {starts}: runs are judged by how far they agree.")
    mask = mask[:, parts[0].stiffness]
    drawn = np.random.default_rng(seed).random((count, starts, mask.shape[1]))
    bounds = np.asarray([(p.lower, p.upper) for p in space.parameters])[parts[0].stiffness]
    values = bounds[:, 0] + drawn * (bounds[:, 1] - bounds[:, 0])
    owner = [(part, one, mode) for part, one in zip(parts, data, strict=True) for mode in range(one.omega.size)]

    found, steps, followed = values.copy(), np.zeros((count, starts), dtype=int), np.full((count, starts), np.nan)
    stop = np.full((count, starts), "nothing_searched", dtype=object)
    least = 0
    solver = SLSQP(rtol=0.0, atol=1e-8, history_length=1) if solver is None else solver
    for size in sorted({*_SIZES, mask.shape[1]}):
        chosen = np.flatnonzero((mask.sum(axis=1) > least) & (mask.sum(axis=1) <= size))
        least = max(least, size)
        if chosen.size == 0:
            continue
        rows = max(int(mask[i][owner[i][0].spring_of].sum()) for i in chosen)
        tasks = [(*owner[i], mask[i], values[i], bounds, rows) for i in chosen]
        made = shared_out(_prepared, tasks, threads)
        common = PartData(*(jnp.asarray(leaf[0]) for leaf in made[0]))
        stacked = tuple(np.concatenate(leaves) for leaves in zip(*made, strict=True))
        first = np.concatenate([_padded(drawn[i][:, mask[i]], size) for i in chosen])
        upper = np.concatenate([np.tile(np.arange(size) < mask[i].sum(), (starts, 1)) for i in chosen])
        free = ParameterSpace([Parameter(f"share.{i}", "", 0.0, 1.0, size=1.0) for i in range(size)])
        objective = Objective(Unlikeness(common), Shares(jnp.full(size, 0.5)), free)
        low, high = np.where(upper, 0.0, 0.5), np.where(upper, 1.0, 0.5)
        ended = solve_lanes(
            objective,
            Task(first, low, high, stacked),
            solver,
            max_steps=max_steps,
            combine=_own,
            threads=threads,
        )
        for k, i in enumerate(chosen):
            own = slice(k * starts, (k + 1) * starts)
            width = bounds[mask[i], 1] - bounds[mask[i], 0]
            found[i][:, mask[i]] = bounds[mask[i], 0] + ended.vector[own, : int(mask[i].sum())] * width
            stop[i], steps[i], followed[i] = ended.stop[own], ended.steps[own], 1 - ended.cost[own]
    problems = tuple(label for one in data for label in one.labels)
    macxp = best_macxp(owner, found, threads)
    return PartRuns(space, parts[0].stiffness, problems, mask, values, found, macxp, followed, stop, steps)


def _own(objective: Objective, data: tuple) -> Objective:
    return Objective(Unlikeness(PartData(*data)), objective.model, objective.space)


def _padded(shares: np.ndarray, size: int) -> np.ndarray:
    return np.concatenate([shares, np.full((len(shares), size - shares.shape[1]), 0.5)], axis=1)


def _prepared(task: tuple[AffineMachine, Evidence, int, np.ndarray, np.ndarray, np.ndarray, int]) -> tuple:
    """What `PartData` holds, for all runs of one problem."""
    part, one, mode, searched, values, bounds, rows = task
    runs, n = len(values), len(part.fixed)
    middle = np.where(searched, bounds.mean(axis=1), values)
    eigenvalues, basis = np.linalg.eigh(part.stiffness_matrices(middle))
    places = np.flatnonzero(searched[part.spring_of])
    vectors = np.zeros((runs, n, rows))
    vectors[:, :, : places.size] = np.swapaxes(basis, 1, 2) @ part.springs[:, places]
    number = np.cumsum(searched) - 1
    weight, owner = np.zeros(rows), np.zeros(rows, dtype=int)
    weight[: places.size] = (bounds[:, 1] - bounds[:, 0])[part.spring_of[places]]
    owner[: places.size] = number[part.spring_of[places]]
    gram = part.output_map.T @ part.output_map
    cross = part.output_map.T @ one.shapes[:, mode]
    strain = part.stiffness_matrices(bounds.mean(axis=1)[None])[0] / one.omega[mode] ** 2
    expanded = np.linalg.solve(gram + _STRAIN * np.trace(gram) / n * strain, cross)
    return (
        eigenvalues,
        vectors,
        np.tile(weight, (runs, 1)),
        np.tile(owner, (runs, 1)),
        np.swapaxes(basis, 1, 2) @ (gram @ basis),
        np.swapaxes(basis, 1, 2) @ cross,
        np.swapaxes(basis, 1, 2) @ expanded,
        np.full(runs, one.omega[mode]),
        np.full(runs, one.ratio[mode]),
    )
