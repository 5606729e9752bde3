"""Runs of SLSQP and of its peer over a collection of nonlinear programmes, and a check of their answers.

Building a program costs seconds where running it costs microseconds. So each problem's functions are compiled once for
all solvers, and the solver's step once for all problems of a class, which are padded to one shape: the step is handed
values and derivatives at the point it wants to try, as a linear function.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from scipy.optimize import OptimizeResult, lsq_linear, minimize

from fitting.solvers.slsqp import SLSQP
from fitting.solvers.stop import CONVERGED, STOPS
from tests.problems.nonlinear_programme import NonlinearProgramme

# Most variables, equalities and inequalities of the problems that share a program.
CLASSES = ((3, 2, 3), (6, 6, 6), (16, 8, 29))
# These programs run for milliseconds, so time spent on making them fast is lost; half of it goes into these.
QUICK = {"xla_backend_optimization_level": 0, "xla_cpu_use_fusion_emitters": False}
MAX_STEPS = 500
TOLERANCE = 1e-6


class Functions(NamedTuple):
    """A problem's functions, compiled together."""

    equalities: int
    """Number of equalities."""
    inequalities: int
    """Number of inequalities."""
    at: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
    """From x to f, h and g in one vector, and its Jacobian."""


class Run(NamedTuple):
    """What a solver made of a problem."""

    problem: NonlinearProgramme
    x: np.ndarray
    """Where it stopped."""
    value: float
    """f there."""
    violation: float
    """Largest violation of a constraint or bound there."""
    residual: float
    """How far the conditions of Karush, Kuhn and Tucker are from holding there, see `stationarity`."""
    evaluations: int
    """Calls of the objective."""
    outside: int
    """How many of them were outside the bounds."""
    status: str
    """Why it stopped, in the solver's words."""
    success: bool
    """Whether it claims a minimum."""

    @property
    def solved(self) -> bool:
        """Whether the published optimum was reached: f to 1e-6 of max(1, |f*|), feasible to 1e-6."""
        close = abs(self.value - self.problem.optimum) <= TOLERANCE * max(1.0, abs(self.problem.optimum))
        return close and self.violation <= TOLERANCE


_KNOWN: dict[tuple[str, int], Functions] = {}


def functions_of(problem: NonlinearProgramme) -> Functions:
    """A problem's functions, compiled at their first call, once in a process."""
    key = (problem.name, id(problem.objective))
    if key not in _KNOWN:
        _KNOWN[key] = _compiled(problem)
    return _KNOWN[key]


def _compiled(problem: NonlinearProgramme) -> Functions:

    def size(function: Callable | None) -> int:
        return 0 if function is None else jax.eval_shape(function, problem.start).size

    def stacked(x: Array) -> Array:
        parts = [part(x) for part in (problem.objective, problem.equality, problem.inequality) if part is not None]
        return jnp.concatenate([jnp.ravel(part) for part in parts])

    @partial(jax.jit, compiler_options=QUICK)
    def both(x: Array) -> tuple[Array, Array]:
        values, slopes = jax.vmap(lambda v: jax.jvp(stacked, (x,), (v,)), out_axes=(None, 1))(jnp.eye(x.size))
        return values, slopes

    def at(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values, slopes = both(np.asarray(x, float))
        return np.asarray(values), np.asarray(slopes)

    return Functions(size(problem.equality), size(problem.inequality), at)


class SlsqpRunner:
    """Our solver over many problems, with one program for each class of shapes."""

    def __init__(self, solver: SLSQP | None = None, classes: Sequence[tuple[int, int, int]] = CLASSES) -> None:
        self.solver = SLSQP() if solver is None else solver
        self.classes = classes
        self.step = jax.jit(self._step, compiler_options=QUICK)

    def __call__(self, problem: NonlinearProgramme) -> Run:
        """Run from the standard start."""
        functions = functions_of(problem)
        wanted = (problem.start.size, functions.equalities, functions.inequalities)
        limit = next(c for c in self.classes if all(a <= b for a, b in zip(wanted, c, strict=True)))
        n, size = limit[0], problem.start.size
        bounds = {name: np.pad(getattr(problem, name), (0, n - size)) for name in ("lower", "upper")}
        y = jnp.pad(jnp.asarray(problem.start), (0, n - size))
        trial = jnp.clip(y, bounds["lower"], bounds["upper"])
        parts = {"objective": jnp.zeros(()), "equality": jnp.zeros(limit[1]), "inequality": jnp.zeros(limit[2])}
        nothing = {name: (part, jnp.zeros((*part.shape, n))) for name, part in parts.items()}
        state = self.solver.init(
            _objective,
            y,
            (trial, nothing),
            {"equality": _equality, "inequality": _inequality} | bounds,
            None,
            None,
            None,
        )
        outside = 0
        for _ in range(MAX_STEPS):
            x = np.asarray(trial)
            outside += int(np.any(x < bounds["lower"]) or np.any(x > bounds["upper"]))
            y, state, trial = self.step(y, state, bounds, (trial, _padded(functions, x[:size], limit)))
            if int(state.reason._value) != 0:
                break
        status = STOPS[int(state.reason._value)]
        return judged(problem, np.asarray(y)[:size], int(state.steps) + 1, outside, status, status in CONVERGED)

    def _step(self, y: Array, state: Any, bounds: dict, linear: Any) -> tuple:
        options = {"equality": _equality, "inequality": _inequality} | bounds
        y, state, _ = self.solver.step(_objective, y, linear, options, state, frozenset())
        return y, state, jnp.clip(y + state.length * state.direction, bounds["lower"], bounds["upper"])


def run_scipy(problem: NonlinearProgramme, ftol: float) -> Run:
    """SciPy's SLSQP from the standard start, with the same values and exact derivatives."""
    answer, points = minimise_by_scipy(problem, ftol)
    outside = sum(bool(np.any(x < problem.lower) or np.any(x > problem.upper)) for x in points)
    return judged(problem, answer.x, int(answer.nfev), outside, str(answer.message), bool(answer.success))


def minimise_by_scipy(problem: NonlinearProgramme, ftol: float) -> tuple[OptimizeResult, list[np.ndarray]]:
    """SciPy's answer as it is, and the points at which it wanted the objective."""
    functions = functions_of(problem)
    equalities = functions.equalities
    last: list[tuple[bytes, tuple]] = []
    points: list[np.ndarray] = []

    def at(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if not last or last[0][0] != x.tobytes():
            last[:] = [(x.tobytes(), functions.at(x))]
        return last[0][1]

    def objective(x: np.ndarray) -> float:
        points.append(x.copy())
        return float(at(x)[0][0])

    rows = {"eq": slice(1, 1 + equalities), "ineq": slice(1 + equalities, None)}
    sizes = {"eq": equalities, "ineq": functions.inequalities}
    answer = minimize(
        objective,
        problem.start,
        jac=lambda x: at(x)[1][0],
        bounds=list(zip(problem.lower, problem.upper, strict=True)),
        constraints=[
            {"type": kind, "fun": partial(_rows, at, 0, rows[kind]), "jac": partial(_rows, at, 1, rows[kind])}
            for kind in rows
            if sizes[kind]
        ],
        method="SLSQP",
        options={"ftol": ftol, "maxiter": MAX_STEPS},
    )
    return answer, points


def stationarity(problem: NonlinearProgramme, x: np.ndarray, width: float = 1e-6) -> float:
    """‖∇f - Cᵀλ - μ‖∞ / max(1, ‖∇f‖∞) at x, for the best multipliers of constraints and bounds that hold with equality.

    Args:
        problem: the programme.
        x: the point.
        width: distance to zero, relative to the size of the normal or of the bound, within which an inequality counts
            as holding with equality.
    """
    functions = functions_of(problem)
    values, slopes = functions.at(x)
    gradient, constraints, normals = slopes[0], values[1:], slopes[1:]
    if not (np.all(np.isfinite(values)) and np.all(np.isfinite(slopes))):
        return np.inf
    equal = np.arange(constraints.size) < functions.equalities
    near = np.abs(constraints) <= width * np.maximum(1.0, np.linalg.norm(normals, axis=1))
    scale = np.maximum(1.0, np.abs(x))
    eye = np.eye(x.size)
    at_lower, at_upper = x - problem.lower <= width * scale, problem.upper - x <= width * scale
    columns = np.concatenate([normals[equal], normals[near & ~equal], eye[at_lower], -eye[at_upper]]).T
    size = max(1.0, float(np.max(np.abs(gradient))))
    if columns.shape[1] == 0:
        return float(np.max(np.abs(gradient))) / size
    length = np.linalg.norm(columns, axis=0)
    columns = columns / np.where(length > 0, length, 1.0)
    lower = np.where(np.arange(columns.shape[1]) < equal.sum(), -np.inf, 0.0)
    best = lsq_linear(columns, gradient, (lower, np.inf), method="bvls", tol=1e-14)
    return float(np.max(np.abs(gradient - columns @ best.x))) / size


def judged(
    problem: NonlinearProgramme, x: np.ndarray, evaluations: int, outside: int, status: str, success: bool
) -> Run:
    """A run with its value, violation and stationarity, all from x alone."""
    functions = functions_of(problem)
    values, _ = functions.at(x)
    equality, inequality = values[1 : 1 + functions.equalities], values[1 + functions.equalities :]
    breaches = np.concatenate([[0.0], np.abs(equality), -inequality, problem.lower - x, x - problem.upper])
    residual = stationarity(problem, x)
    return Run(problem, x, float(values[0]), float(breaches.max()), residual, evaluations, outside, status, success)


def _rows(at: Callable, part: int, rows: slice, x: np.ndarray) -> np.ndarray:
    return at(x)[part][rows]


def _padded(functions: Functions, x: np.ndarray, limit: tuple[int, int, int]) -> dict[str, tuple]:
    """Values and Jacobians with variables that nothing depends on, with 0 = 0 and with 1 ≥ 0."""
    values, slopes = functions.at(x)
    wide = np.pad(slopes, [(0, 0), (0, limit[0] - x.size)])
    h, g = slice(1, 1 + functions.equalities), slice(1 + functions.equalities, None)

    def longer(rows: slice, length: int, filling: float) -> tuple[np.ndarray, np.ndarray]:
        more = length - values[rows].size
        return np.pad(values[rows], (0, more), constant_values=filling), np.pad(wide[rows], [(0, more), (0, 0)])

    return {
        "objective": (values[0], wide[0]),
        "equality": longer(h, limit[1], 0.0),
        "inequality": longer(g, limit[2], 1.0),
    }


def _line(name: str, y: Array, linear: Any) -> Array:
    trial, parts = linear
    value, slope = parts[name]
    return value + slope @ (y - trial)


def _objective(y: Array, linear: Any) -> tuple[Array, None]:
    return _line("objective", y, linear), None


_equality = partial(_line, "equality")
_inequality = partial(_line, "inequality")
