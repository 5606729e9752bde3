"""Many fits of one structure in step: a fixed number of lanes, refilled from a queue as fits end.

Lanes of one program run in lockstep, so a batch would wait for its slowest fit, and every batch size is a program of
its own. Here the program has one width. A lane whose fit has ended takes the next start, and one thread per core keeps
its own set of lanes. What a fit does depends on nothing in the other lanes, to the last bit.
"""

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PyTree

from fitting.objective import Objective, cost_of, equality_of, inequality_of, residual_of
from fitting.solve import Solved, Solver, options_of, outcome
from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt, BoundedState
from fitting.solvers.stop import CONVERGED, STOPS, Stop
from twin._cores import usable_cores
from twin._lapack import calls_lapack
from twin._recursion import tangents_alongside

Combine = Callable[[Objective, Any], Objective]
Keep = Callable[[float, float], bool]

WIDTH = 16
"""Lanes of one program: a multiple of every vector length, so that no lane is computed differently from another, and
few enough that Jacobians stay in the cache."""
STRIDE = 4
"""Steps between two looks at which lanes have ended."""


class Task(NamedTuple):
    """Starts of many fits; every array has one row per fit."""

    start: np.ndarray
    """Scaled vectors (fits, parameters)."""
    lower: np.ndarray
    """Lower bounds (fits, parameters); equal to the upper one where a parameter is held."""
    upper: np.ndarray
    """Upper bounds (fits, parameters)."""
    data: PyTree = None
    """What else differs between the fits: see `combine` of `solve_lanes`."""


class Ended(NamedTuple):
    """Where many fits ended, one row per fit."""

    vector: np.ndarray
    """Scaled vectors (fits, parameters); NaN for fits whose start is not finite."""
    cost: np.ndarray
    """Half the sum of squared residuals (fits,); NaN for fits whose start is not finite."""
    stop: np.ndarray
    """Name of the reason for stopping, one of `STOPS` (fits,)."""
    steps: np.ndarray
    """Steps taken (fits,)."""
    active: np.ndarray
    """Which parameters sit on a bound (fits, parameters)."""
    kept: dict[int, Solved]
    """Everything about the fits that were to be kept, by number."""

    @property
    def success(self) -> np.ndarray:
        """Which fits converged (fits,)."""
        return np.isin(self.stop, CONVERGED)


def solve_lanes(
    objective: Objective,
    task: Task,
    solver: Solver,
    *,
    max_steps: int = 100,
    combine: Combine | None = None,
    keep: Keep | None = None,
    width: int = WIDTH,
    stride: int = STRIDE,
    threads: int | None = None,
) -> Ended:
    """Run many fits that differ in start, bounds and data.

    Args:
        objective: what is common to all.
        task: what is not.
        solver: Levenberg-Marquardt or SLSQP, with its settings.
        max_steps: steps after which a fit is given up.
        combine: the objective of one fit, from the common one and its row of `task.data`; a function defined once.
        keep: whether to keep everything about a fit that ended, from its cost and the best cost so far (of those that
            converged, or of those that did not, whichever it is one of).
        width: lanes of the program.
        stride: steps between two looks at which lanes have ended.
        threads: sets of lanes that run side by side. If not given, the number of cores; one on an accelerator, and
            where the residual calls LAPACK (`jnp.linalg`), as two programs that do can wait for each other for ever.

    Returns:
        Where the fits ended, in the order of the task.
    """
    count, size = task.start.shape
    if threads is None:
        threads = len(usable_cores()) if jax.default_backend() == "cpu" else 1
        if (
            threads > 1
            and count > width
            and calls_lapack(_evaluated, objective, combine, _rows(task, np.zeros(1, dtype=int)))
        ):
            threads = 1
    ended = Ended(
        vector=np.full((count, size), np.nan),
        cost=np.full(count, np.nan),
        stop=np.full(count, "running", dtype=object),
        steps=np.zeros(count, dtype=int),
        active=np.zeros((count, size), dtype=bool),
        kept={},
    )
    if count == 0:
        return ended
    lock, turn, best = threading.Lock(), iter(range(count)), {True: np.inf, False: np.inf}

    failed = threading.Event()

    def take() -> int:
        with lock:
            return -1 if failed.is_set() else next(turn, -1)

    def wanted(cost: float, converged: bool) -> bool:
        with lock:
            best[converged] = min(best[converged], cost)
            return keep is not None and keep(cost, best[converged])

    def work() -> None:
        # A thread does not inherit what its starter set for a while.
        with jax.enable_x64(True):
            try:
                run()
            except BaseException:
                failed.set()
                raise

    def run() -> None:
        numbers = np.asarray([take() for _ in range(width)])
        fresh = np.ones(width, dtype=bool)
        lanes, carried = _rows(task, numbers), None
        while np.any(numbers >= 0):
            advance = partial(_advance, solver, objective, combine, max_steps, stride, lanes)
            if carried is None:
                # Two threads that meet an unknown program would both compile it.
                with _COMPILING:
                    carried, light = advance(_blank(solver, objective, combine, lanes), fresh, numbers >= 0)
            else:
                carried, light = advance(carried, fresh, numbers >= 0)
            light = jax.device_get(light)
            fresh = np.zeros(width, dtype=bool)
            for slot in np.flatnonzero(~light.running & (numbers >= 0)):
                number, cost = numbers[slot], float(light.cost[slot])
                ended.stop[number], ended.steps[number] = _name(int(light.reason[slot])), light.steps[slot]
                if ended.stop[number] != "not_finite":
                    ended.vector[number], ended.cost[number] = light.vector[slot], cost
                    ended.active[number] = light.active[slot]
                    if wanted(cost, ended.stop[number] in CONVERGED):
                        lane = jax.tree.map(lambda leaf, i=slot: leaf[i], (carried, lanes))
                        ended.kept[int(number)] = _outcome(solver, objective, combine, *lane)
                numbers[slot] = take()
                fresh[slot] = numbers[slot] >= 0
            if fresh.any():
                lanes = _rows(task, numbers)

    threads = max(1, min(threads, -(-count // width)))
    if threads == 1:
        work()
    else:
        with ThreadPoolExecutor(threads) as pool:
            for future in [pool.submit(work) for _ in range(threads)]:
                future.result()
    return ended


_COMPILING = threading.Lock()


@eqx.filter_jit
def _evaluated(objective: Objective, combine: Combine | None, lanes: Task) -> Any:
    """All values of the first lane and their derivatives along a line; jitted for the sake of the cache of traces."""
    lane = jax.tree.map(lambda leaf: leaf[0], lanes)
    own = objective if combine is None else combine(objective, lane.data)

    def values(vector: Array) -> Any:
        return residual_of(vector, own), equality_of(vector, own), inequality_of(vector, own)

    vector = jnp.asarray(lane.start)
    return jax.jvp(values, (vector,), (jnp.ones_like(vector),))


class _Light(NamedTuple):
    """What is looked at between two strides."""

    running: Any
    vector: Any
    cost: Any
    steps: Any
    reason: Any
    active: Any


def _rows(task: Task, numbers: np.ndarray) -> Task:
    """The rows of the fits in the lanes; empty lanes repeat the first."""
    index = np.maximum(numbers, 0)
    return jax.tree.map(lambda leaf: np.asarray(leaf)[index], task)


def _problem(solver: Solver, objective: Objective, combine: Combine | None, lane: Task) -> tuple[Objective, Any, dict]:
    """Objective, function and options of the fit in one lane."""
    own = objective if combine is None else combine(objective, lane.data)
    options = {**options_of(own, jnp.asarray(lane.lower), jnp.asarray(lane.upper)), "together": True}
    return own, residual_of if isinstance(solver, BoundedLevenbergMarquardt) else cost_of, options


def _init(solver: Solver, objective: Objective, combine: Combine | None, lane: Task) -> tuple[Array, Any]:
    own, function, options = _problem(solver, objective, combine, lane)
    start = jnp.asarray(lane.start)
    shape, aux = eqx.filter_eval_shape(function, start, own)
    return start, solver.init(function, start, own, options, shape, aux, frozenset())


@eqx.filter_jit
def _blank(solver: Solver, objective: Objective, combine: Combine | None, lanes: Task) -> tuple[Array, Any]:
    blank = eqx.filter_vmap(partial(_init, solver, objective, combine))(lanes)
    # As `_advance` returns it, without weak types: one program then serves the first call and all others.
    return jax.tree.map(lambda leaf: jax.lax.convert_element_type(leaf, leaf.dtype), blank)


@eqx.filter_jit
def _advance(
    solver: Solver,
    objective: Objective,
    combine: Combine | None,
    max_steps: int,
    stride: int,
    lanes: Task,
    carried: tuple[Array, Any],
    fresh: Any,
    busy: Any,
) -> tuple[tuple[Array, Any], _Light]:
    """Put new starts into the fresh lanes and take some steps in all."""

    def replace(new: Any, old: Any) -> Any:
        return jax.tree.map(lambda a, b: jnp.where(_like(fresh, a), a, b), new, old)

    def one(lane: Task, vector: Array, state: Any) -> tuple[Array, Any]:
        own, function, options = _problem(solver, objective, combine, lane)
        with tangents_alongside():
            vector, state, _ = solver.step(function, vector, own, options, state, frozenset())
        return vector, state

    def running(state: Any) -> Array:
        return (state.reason._value == Stop.running._value) & (state.steps < max_steps) & busy

    def body(carry: tuple) -> tuple:
        count, vector, state = carry
        on = running(state)
        new = eqx.filter_vmap(one)(lanes, vector, state)
        vector, state = jax.tree.map(lambda a, b: jnp.where(_like(on, a), a, b), new, (vector, state))
        return count + 1, vector, state

    def unfinished(carry: tuple) -> Array:
        count, _, state = carry
        return (count < stride) & jnp.any(running(state))

    begun = eqx.filter_vmap(partial(_init, solver, objective, combine))(lanes)
    _, vector, state = jax.lax.while_loop(unfinished, body, (jnp.asarray(0), *replace(begun, carried)))
    cost = 0.5 * jnp.sum(state.residual**2, axis=-1) if isinstance(state, BoundedState) else state.here.value
    return (vector, state), _Light(running(state), vector, cost, state.steps, state.reason._value, state.active)


@eqx.filter_jit
def _outcome(
    solver: Solver, objective: Objective, combine: Combine | None, carried: tuple[Array, Any], lane: Task
) -> Solved:
    vector, state = carried
    reason = Stop.where(state.reason == Stop.running, Stop.too_many_steps, state.reason)
    return outcome(vector, state, reason, _problem(solver, objective, combine, lane)[0])


def _like(mask: Array, leaf: Array) -> Array:
    return jnp.reshape(mask, mask.shape + (1,) * (leaf.ndim - 1))


def _name(reason: int) -> str:
    name = {int(getattr(Stop, name)._value): name for name in STOPS}[reason]
    return "too_many_steps" if name == "running" else name
