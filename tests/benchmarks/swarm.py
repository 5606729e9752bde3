"""Swarm ledger: what a particle swarm, SLSQP and Levenberg-Marquardt pay for the same error.

The problems are those that Leipe et al. give to a swarm (stiffness and damping surfaces, eq. 3 to 10, with the
published parameters as truth and noise of the published remaining error), the drive fits of `drive_case` and
`frequency_case`, and those of `swarm_cases`.
"""

import contextlib
import os
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple
from unittest import mock

import jax
import jax.numpy as jnp
import numpy as np

from fitting.multistart import multistart
from fitting.objective import Objective
from fitting.residuals.load_surface import LoadSurfaceResidual, total_over_contacts
from fitting.solve import Solver
from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt
from fitting.solvers.slsqp import SLSQP
from tests.benchmarks.drive_case import drive_case, space_around
from tests.benchmarks.frequency_case import frequency_case
from tests.benchmarks.summary import SummaryRow, ratio_row
from tests.benchmarks.swarm_cases import (
    SwarmProblem,
    ellinger_small_problem,
)
from twin.laws import AbstractLoadLaw, HyperbolicDamping, RootStiffness

CLOSE = 1.001
"""Cost, relative to the best known, that counts as the same error."""


class Ledger(NamedTuple):
    """What one method paid on one problem."""

    problem: str
    method: str
    evaluations: int
    """Simulations of the model until the error was reached (a Jacobian counts one for each parameter)."""
    seconds: float
    """Time for that, compiled before [s]."""
    reached: bool
    """Whether the error was reached at all."""


def _surface(law: AbstractLoadLaw, units: dict[str, str], relative: float) -> SwarmProblem:
    rng = np.random.default_rng(2)
    mean = np.linspace(200.0, 3000.0, 30)
    forces = np.stack([mean * (1 + 0.1 * rng.standard_normal(30)), mean * (1 + 0.1 * rng.standard_normal(30))])
    clean = np.asarray(total_over_contacts(law, forces))
    deviation = relative * np.linalg.norm(clean) / np.sqrt(clean.size)
    measured = clean + deviation * rng.standard_normal(clean.size)
    truth = {path: (float(getattr(law, path)), unit) for path, unit in units.items()}
    return SwarmProblem(LoadSurfaceResidual(forces, measured, deviation), law, space_around(truth, 20.0))


def problems() -> dict[str, Callable[[], SwarmProblem]]:
    """Name of each problem, with its number of parameters, and what makes it."""
    stiffness = RootStiffness(1.8709e7, 5.6406)
    damping = HyperbolicDamping(9.5376e5, 148.3813, 2.0734e4)

    def fit_of(case: Any) -> SwarmProblem:
        return SwarmProblem(case.residual, case.model, case.space)

    return {
        "Leipe stiffness (2)": lambda: _surface(stiffness, {"k1": "N/m", "k2": ""}, 0.0401),
        "Leipe damping (3)": lambda: _surface(damping, {"d1": "N^2 s/m", "d2": "N", "d3": "N s/m"}, 0.0451),
        "drive record (8)": lambda: fit_of(drive_case(200)),
        "drive's frequency responses (8)": lambda: fit_of(frequency_case()),
        "Ellinger, one mode's 1 - MACXP (5)": ellinger_small_problem,
    }


def swarm_ledger(
    made: Mapping[str, Callable[[], SwarmProblem]] | None = None, *, particles: int = 40, seed: int = 1
) -> list[Ledger]:
    """Run all methods on all problems.

    Args:
        made: problems by name; all of `problems` if not given.
        particles: of the swarm.
        seed: of the swarm.
    """
    rows = []
    for name, make in (problems() if made is None else made).items():
        problem = make()
        found = []
        for solver in (BoundedLevenbergMarquardt(), SLSQP()):
            for starts in (1, problem.starts):  # the first compiles
                clock = time.perf_counter()
                steps, costs = _fits(problem, solver, starts)
                seconds = time.perf_counter() - clock
            paid = int((steps + 1).sum()) * (len(problem.space) + 1)
            method = f"{type(solver).__name__}, {problem.starts} starts"
            best = float(np.min(costs, where=~np.isnan(costs), initial=np.inf))
            found.append((method, paid, seconds, best))
        target = CLOSE * min(cost for *_, cost in found) + problem.slack
        rows += [Ledger(name, method, paid, seconds, cost <= target) for method, paid, seconds, cost in found]
        rows.append(_swarm(name, problem, target, particles, seed))
    return rows


def _fits(problem: SwarmProblem, solver: Solver, starts: int) -> tuple[np.ndarray, np.ndarray]:
    """Steps and costs of fits from random starts."""
    result = multistart(*problem[:3], starts=starts, solver=solver, max_steps=problem.max_steps, width=8)
    return result.steps, result.costs


class _Reached(Exception):
    """The swarm is as good as the target."""


@contextlib.contextmanager
def _pyswarms() -> Iterator[Any]:
    """The package, kept from writing `report.log` into the working directory: its logging is what LOG_CFG names."""
    with tempfile.TemporaryDirectory() as folder:
        nothing = Path(folder) / "logging.yml"
        nothing.write_text("{version: 1, disable_existing_loggers: false}", encoding="utf-8")
        with mock.patch.dict(os.environ, LOG_CFG=str(nothing)):
            import pyswarms

            yield pyswarms


def _swarm(name: str, problem: SwarmProblem, target: float, particles: int, seed: int) -> Ledger:
    residual, model, space = problem[:3]
    objective = Objective(residual, model, space)
    costs = jax.jit(lambda o, x: jax.vmap(lambda v: 0.5 * jnp.sum(o(v)[0] ** 2))(x))
    bounds = (np.asarray(space.lower), np.asarray(space.upper))
    costs(objective, jnp.asarray(np.tile(bounds[0], (particles, 1)))).block_until_ready()
    paid = 0

    def evaluate(x: np.ndarray) -> np.ndarray:
        nonlocal paid
        paid += len(x)
        found = np.nan_to_num(np.asarray(costs(objective, jnp.asarray(x))), nan=np.inf)
        if found.min() <= target:
            raise _Reached
        return found

    np.random.seed(seed)  # noqa: NPY002 (pyswarms draws from NumPy's global generator)
    options = {"c1": 1.49445, "c2": 1.49445, "w": 0.729}  # Clerc and Kennedy's constriction
    with _pyswarms() as pyswarms:
        swarm = pyswarms.single.GlobalBestPSO(particles, len(space), options, bounds=bounds)
        clock = time.perf_counter()
        try:
            swarm.optimize(evaluate, problem.iterations, verbose=False)
            reached = False
        except _Reached:
            reached = True
        seconds = time.perf_counter() - clock
    return Ledger(name, f"swarm of {particles}", paid, seconds, reached)


def summary_rows(rows: list[Ledger]) -> list[SummaryRow]:
    """The ratios for the summary: what the swarm pays over what the cheapest gradient method pays."""
    found = []
    for problem in dict.fromkeys(row.problem for row in rows):
        *ours, swarm = (row for row in rows if row.problem == problem)
        best = min((row for row in ours if row.reached), key=lambda row: row.evaluations)
        told = "same cost to 0.1 %" if swarm.reached else "swarm did not get there: a lower bound"
        for name in ("evaluations", "seconds"):
            what = f"{problem}, {best.method}, {name}"
            found.append(ratio_row(what, swarm.method, [getattr(swarm, name)], [getattr(best, name)], told))
    return found


def as_markdown(rows: list[Ledger]) -> str:
    """Table of the ledger."""
    lines = [
        "## Swarm ledger: the price of the same error",
        "",
        f"Until the cost is within {100 * (CLOSE - 1):.1g} % of the best known; a Jacobian counts one per parameter. "
        "1 - MACXP, whose least is zero, is to be within 1e-6 of it.",
        "",
        "| problem (parameters) | method | simulations | seconds | reached |",
        "|---|---|---|---|---|",
    ]
    lines += [
        f"| {r.problem} | {r.method} | {r.evaluations} | {r.seconds:.3f} | {'yes' if r.reached else 'no'} |"
        for r in rows
    ]
    return "\n".join(lines) + "\n"


def as_dictionary(rows: list[Ledger]) -> list[dict]:
    """The rows for `benchmarks.json`."""
    return [row._asdict() for row in rows]
