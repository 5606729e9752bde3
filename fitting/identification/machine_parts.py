"""One small problem per reference mode: the few springs that move it, searched from many random starts.

Source: section 2.3.2 of J. Ellinger, M. F. Zaeh, Machines 10 (2022) 535.
"""

import dataclasses
from collections.abc import Callable, Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool

from fitting.identification.machine_affine import affine_machine
from fitting.identification.machine_evidence import evidence
from fitting.identification.machine_likeness import PartData, Shares, Unlikeness
from fitting.identification.machine_part_data import PartProblem, data_from_mode, data_from_start, shares_of
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
# Lanes of a program: each step is many short operations, whose calls cost less beside more lanes.
_WIDTH = 32


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
    rounds: int = 2,
    threads: int | None = None,
) -> PartRuns:
    """Search, for each reference mode, the springs that move it for the greatest MACXP, from many random starts.

    Runs that fail are solved again, from where they ended and from the mode that is most alike there. What comes right
    replaces the run; what does not leaves it as it was, marked.

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
        rounds: how often a run that failed is solved again; each time takes up to `max_steps` more.
        threads: runs side by side; the number of cores if not given.

    Returns:
        All runs, each checked against all modes of the machine.

    Raises:
        InputError: 64-bit mode off, a parameter that is no stiffness or damping of a joint, reference data that cannot
            be compared, a mask of another shape, fewer than two starts, a negative number of rounds.
    """
    data = evidence(references, positions)
    parts = [affine_machine(machine, space, one.position, one.outputs) for one in data]
    count = sum(one.omega.size for one in data)
    mask = np.asarray(searched, dtype=bool)
    if mask.shape != (count, len(space)):
        raise InputError(
            f"searched has shape {mask.shape}, but there are {count} reference modes and {len(space)} parameters."
        )
    require_starts(starts)
    if rounds < 0:
        raise InputError(f"rounds must not be negative, but is {rounds}. Take 0 to solve no run again.")
    mask = mask[:, parts[0].stiffness]
    drawn = np.random.default_rng(seed).random((count, starts, mask.shape[1]))
    bounds = np.asarray([(p.lower, p.upper) for p in space.parameters])[parts[0].stiffness]
    values = bounds[:, 0] + drawn * (bounds[:, 1] - bounds[:, 0])
    sizes = sorted({*_SIZES, mask.shape[1]})
    size = np.asarray([next(n for n in sizes if n >= m) for m in mask.sum(axis=1)])
    owner = [(part, one, mode) for part, one in zip(parts, data, strict=True) for mode in range(one.omega.size)]
    places = np.asarray([mask[i][owner[i][0].spring_of].sum() for i in range(count)])
    # Problems of one size share a program.
    rows = [int(places[size == n].max()) for n in size]
    problems = [PartProblem(*owner[i], mask[i], bounds, rows[i], int(size[i])) for i in range(count)]
    solver = SLSQP(rtol=0.0, atol=1e-8, history_length=1) if solver is None else solver
    settings = {"solver": solver, "max_steps": max_steps, "threads": threads}

    labels = tuple(label for one in data for label in one.labels)
    value, steps, followed = values.copy(), np.zeros((count, starts), dtype=int), np.full((count, starts), np.nan)
    stop = np.full((count, starts), "nothing_searched", dtype=object)
    wanted = mask.sum(axis=1)[:, None] > 0
    todo = np.repeat(wanted, starts, axis=1)
    value[todo], followed[todo], stop[todo], steps[todo] = _solved(problems, values, todo, data_from_start, **settings)
    macxp = best_macxp(owner, value, threads)
    runs = PartRuns(
        space, parts[0].stiffness, labels, mask, values, value, macxp, followed, stop, steps, np.zeros_like(steps)
    )
    begin = np.where(np.isfinite(value).all(axis=2, keepdims=True), value, values)
    for _ in range(rounds):
        todo = runs.failed & wanted
        if not todo.any():
            break
        ended = _solved(problems, begin, todo, data_from_mode, **settings)
        runs, begin = _mended(runs, owner, begin, todo, ended, threads)
    return runs


def require_starts(starts: int) -> None:
    """Raise unless a problem has runs that can agree.

    Args:
        starts: runs of each problem.

    Raises:
        InputError: fewer than two.
    """
    if starts < 2:
        raise InputError(f"starts must be at least 2, but is {starts}: runs are judged by how far they agree.")


def _solved(
    problems: list[PartProblem],
    begin: np.ndarray,
    todo: np.ndarray,
    prepare: Callable[[PartProblem, np.ndarray], tuple[np.ndarray, ...]],
    *,
    solver: SLSQP,
    max_steps: int,
    threads: int | None,
) -> tuple[np.ndarray, ...]:
    """Values, MACXP followed, reasons for stopping and steps of the runs to do, problem by problem."""
    value, followed = begin.copy(), np.full(todo.shape, np.nan)
    stop, steps = np.full(todo.shape, "running", dtype=object), np.zeros(todo.shape, dtype=int)
    busy = np.flatnonzero(todo.any(axis=1))
    for size in sorted({problems[i].size for i in busy}):
        chosen = [i for i in busy if problems[i].size == size]
        made = shared_out(lambda i: prepare(problems[i], begin[i][todo[i]]), chosen, threads)
        common = PartData(*(jnp.asarray(leaf[0]) for leaf in made[0]))
        stacked = tuple(np.concatenate(leaves) for leaves in zip(*made, strict=True))
        first = np.concatenate([shares_of(problems[i], begin[i][todo[i]]) for i in chosen])
        free = np.concatenate(
            [np.tile(np.arange(size) < problems[i].searched.sum(), (todo[i].sum(), 1)) for i in chosen]
        )
        space = ParameterSpace([Parameter(f"share.{i}", "", 0.0, 1.0, size=1.0) for i in range(size)])
        objective = Objective(Unlikeness(common), Shares(jnp.full(size, 0.5)), space)
        task = Task(first, np.where(free, 0.0, 0.5), np.where(free, 1.0, 0.5), stacked)
        ended = solve_lanes(objective, task, solver, max_steps=max_steps, combine=_own, width=_WIDTH, threads=threads)
        at = 0
        for i in chosen:
            one, own = problems[i], slice(at, at + todo[i].sum())
            at = own.stop
            low, high = one.bounds[one.searched].T
            # Only the searched stiffnesses of the runs to do.
            value[i][np.ix_(todo[i], one.searched)] = low + ended.vector[own, : low.size] * (high - low)
            stop[i][todo[i]], steps[i][todo[i]] = ended.stop[own], ended.steps[own]
            followed[i][todo[i]] = 1 - ended.cost[own]
    return value[todo], followed[todo], stop[todo], steps[todo]


def _mended(
    runs: PartRuns, owner: list, begin: np.ndarray, todo: np.ndarray, ended: tuple[np.ndarray, ...], threads: int | None
) -> tuple[PartRuns, np.ndarray]:
    """The runs with those replaced that came right, and where the others begin the next time."""
    value, followed, stop, steps = ended
    values = np.full_like(begin, np.nan)
    values[todo] = value
    macxp = best_macxp(owner, values, threads)

    def put(old: np.ndarray, new: np.ndarray) -> np.ndarray:
        whole = old.copy()
        whole[todo] = new
        return whole

    tried = dataclasses.replace(
        runs, value=values, macxp=macxp, followed=put(runs.followed, followed), stop=put(runs.stop, stop)
    )
    right = todo & ~tried.failed
    kept = {
        name: np.where(right[..., None] if name == "value" else right, getattr(tried, name), getattr(runs, name))
        for name in ("value", "macxp", "followed", "stop")
    }
    further = todo & np.isfinite(macxp)
    return (
        dataclasses.replace(runs, **kept, steps=put(runs.steps, runs.steps[todo] + steps), again=runs.again + todo),
        np.where(further[..., None], values, begin),
    )


def _own(objective: Objective, data: tuple) -> Objective:
    return Objective(Unlikeness(PartData(*data)), objective.model, objective.space)
