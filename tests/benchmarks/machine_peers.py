"""The study of a machine by NumPy, SciPy and SALib: an eigenproblem a sample, finite differences, a process a core.

Imports nothing of the twin, so that its processes start quickly. It is given the matrices ready, in coordinates in
which the mass matrix is the identity: plain eigenproblems, which is more than most scripts do.
"""

import contextlib
import multiprocessing
import os
import time
from collections.abc import Iterator, Sequence
from multiprocessing.pool import Pool
from typing import NamedTuple
from unittest import mock

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import minimize

# Least MACXP of a pair, and accuracy and steps of a solve: as ours.
_THRESHOLD, _FTOL, _STEPS = 0.3, 1e-8, 100


class Place(NamedTuple):
    """The machine and its reference modes at one position; see `AffineMachine` and `Evidence`."""

    fixed: np.ndarray
    springs: np.ndarray
    spring_of: np.ndarray
    stiffness: np.ndarray
    viscous: np.ndarray
    hysteretic: np.ndarray
    dampers: np.ndarray
    damper_of: np.ndarray
    damping: np.ndarray
    is_viscous: np.ndarray
    output_map: np.ndarray
    omega: np.ndarray
    ratio: np.ndarray
    shapes: np.ndarray


class Solve(NamedTuple):
    """One bounded solve from one start."""

    place: Place
    mode: int
    """Number of the reference mode."""
    searched: np.ndarray
    """Numbers of the searched stiffnesses among all."""
    values: np.ndarray
    """All stiffnesses at the start."""
    lower: np.ndarray
    upper: np.ndarray


def mode_outputs(places: Sequence[Place], sample: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """MACXP and NDD² of every reference mode at every position, in one sample of all parameters."""
    found = [_at(place, sample) for place in places]
    return np.concatenate([shape for shape, _ in found]), np.concatenate([damping for _, damping in found])


def _at(place: Place, sample: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    eigenvalues, shapes = _modes(place, sample[place.stiffness])
    alike = macxp(eigenvalues, shapes, place, slice(None))
    order = _paired(alike)
    omega, own = np.sqrt(np.maximum(eigenvalues[order], 1e-12 * eigenvalues[-1])), shapes[:, order]
    value, viscous = sample[place.damping][place.damper_of], place.is_viscous[place.damper_of]
    strokes = (place.dampers.T @ own) ** 2
    ratio = (np.sum((place.viscous @ own) * own, axis=0) + (value * viscous) @ strokes) / (2 * omega)
    ratio += (np.sum((place.hysteretic @ own) * own, axis=0) + (value * ~viscous) @ strokes) / (2 * omega**2)
    return alike[order, np.arange(order.size)], (ratio / place.ratio - 1) ** 2


def _modes(place: Place, stiffness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    matrix = place.fixed + (place.springs * stiffness[place.spring_of]) @ place.springs.T
    return eigh(matrix, driver="evd", check_finite=False)


def macxp(eigenvalues: np.ndarray, shapes: np.ndarray, place: Place, references: slice) -> np.ndarray:
    """Eq. 4 of Ellinger and Zaeh for real shapes damped as the reference (modes, references)."""
    moved, reference = place.output_map @ shapes, place.shapes[:, references]
    mac = (moved.T @ reference) ** 2 / np.sum(moved**2, axis=0)[:, None]
    ratio, omega = place.ratio[references], np.sqrt(np.maximum(eigenvalues, 0.0))[:, None]
    ours, theirs = (w * (-ratio + 1j * np.sqrt(1 - ratio**2)) for w in (omega, place.omega[references]))
    across = 1 / np.abs(ours.conj() + theirs) + 1 / np.abs(ours + theirs)

    def own(pole: np.ndarray) -> np.ndarray:
        return 1 / np.abs(2 * pole.real) + 1 / (2 * np.abs(pole))

    return mac * across**2 / (own(ours) * own(theirs))


def _paired(alike: np.ndarray) -> np.ndarray:
    """Most alike pair first; what is left over takes the mode most like it."""
    order, left = alike.argmax(axis=0), alike.copy()
    for _ in range(order.size):
        mode, reference = np.unravel_index(left.argmax(), left.shape)
        if left[mode, reference] < _THRESHOLD:
            break
        order[reference] = mode
        left[mode], left[:, reference] = -1.0, -1.0
    return order


def solve(task: Solve) -> tuple[float, int, int]:
    """1 - MACXP at the end by SciPy's SLSQP with finite differences, eigenproblems solved, iterations."""
    place, searched = task.place, task.searched
    width = task.upper - task.lower

    def unlike(share: np.ndarray) -> float:
        stiffness = task.values.copy()
        stiffness[searched] = task.lower + share * width
        eigenvalues, shapes = _modes(place, stiffness)
        return 1 - float(macxp(eigenvalues, shapes, place, slice(task.mode, task.mode + 1)).max())

    start = (task.values[searched] - task.lower) / width
    options = {"ftol": _FTOL, "maxiter": _STEPS}
    found = minimize(unlike, start, method="SLSQP", bounds=[(0.0, 1.0)] * start.size, options=options)
    return float(found.fun), int(found.nfev), int(found.nit)


def salib_samples(names: Sequence[str], bounds: np.ndarray, n: int, seed: int) -> np.ndarray:
    """SALib's samples (rows, parameters)."""
    from SALib.sample import sobol

    return sobol.sample(_problem(names, bounds), n, calc_second_order=False, seed=seed)


def _problem(names: Sequence[str], bounds: np.ndarray) -> dict:
    return {"num_vars": len(names), "names": list(names), "bounds": bounds.tolist()}


@contextlib.contextmanager
def processes(places: Sequence[Place], number: int | None = None) -> Iterator[Pool]:
    """One process per core, each with one thread for linear algebra, started and ready.

    Args:
        places: the machine at each position.
        number: of processes; the number of cores if not given.
    """
    one_thread = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    count = number or os.cpu_count() or 1
    with (
        mock.patch.dict(os.environ, one_thread),
        multiprocessing.get_context("spawn").Pool(count, _begin, (tuple(places),)) as pool,
    ):
        pool.map(_awake, range(count), chunksize=1)
        yield pool


def run_samples(pool: Pool, samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """MACXP and NDD² of all samples (samples, modes of all positions)."""
    pieces = pool.map(_sampled, np.array_split(samples, max(1, len(samples) // 16)), chunksize=1)
    shape, damping = zip(*pieces, strict=True)
    return np.concatenate(shape), np.concatenate(damping)


def run_solves(pool: Pool, tasks: Sequence[Solve]) -> list[tuple[float, int, int]]:
    """`solve` of all tasks."""
    return pool.map(solve, tasks, chunksize=1)


def run_analyses(pool: Pool, names: Sequence[str], bounds: np.ndarray, outputs: np.ndarray) -> np.ndarray:
    """Total effects by SALib, of every column of outputs (outputs, parameters)."""
    return np.stack(pool.map(_analysed, [(_problem(names, bounds), column) for column in outputs.T], chunksize=1))


_PLACES: tuple[Place, ...] = ()


def _begin(places: tuple[Place, ...]) -> None:
    global _PLACES
    _PLACES = places


def _awake(_: int) -> None:
    from SALib.analyze import sobol  # noqa: F401 (the first import takes its time)

    for place in _PLACES:
        _modes(place, np.ones(place.stiffness.size))
    # Long enough for every process to take one.
    time.sleep(0.5)


def _sampled(samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    shape, damping = zip(*(mode_outputs(_PLACES, sample) for sample in samples), strict=True)
    return np.stack(shape), np.stack(damping)


def _analysed(task: tuple[dict, np.ndarray]) -> np.ndarray:
    from SALib.analyze import sobol

    problem, column = task
    return np.asarray(sobol.analyze(problem, column, calc_second_order=False, num_resamples=100, seed=1)["ST"])
