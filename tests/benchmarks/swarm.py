"""Swarm ledger: what a particle swarm, SLSQP and Levenberg-Marquardt pay for the same error.

The problems are those that Leipe et al. give to a swarm (stiffness and damping surfaces, eq. 3 to 10, with the
published parameters as truth and noise of the published remaining error), and the drive fits of `drive_case` and
`frequency_case`.
"""

import contextlib
import os
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple
from unittest import mock

import jax
import jax.numpy as jnp
import numpy as np

from fitting.multistart import multistart
from fitting.objective import Objective
from fitting.residuals.load_surface import LoadSurfaceResidual, total_over_contacts
from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt
from fitting.solvers.slsqp import SLSQP
from tests.benchmarks.drive_case import drive_case, space_around
from tests.benchmarks.frequency_case import frequency_case
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


def _surface(law: AbstractLoadLaw, units: dict[str, str], relative: float) -> tuple:
    rng = np.random.default_rng(2)
    mean = np.linspace(200.0, 3000.0, 30)
    forces = np.stack([mean * (1 + 0.1 * rng.standard_normal(30)), mean * (1 + 0.1 * rng.standard_normal(30))])
    clean = np.asarray(total_over_contacts(law, forces))
    deviation = relative * np.linalg.norm(clean) / np.sqrt(clean.size)
    measured = clean + deviation * rng.standard_normal(clean.size)
    truth = {path: (float(getattr(law, path)), unit) for path, unit in units.items()}
    return LoadSurfaceResidual(forces, measured, deviation), law, space_around(truth, 20.0)


def problems():
    """Name, residual, model and space of each problem."""
    drive, responses = drive_case(200), frequency_case()
    stiffness = RootStiffness(1.8709e7, 5.6406)
    damping = HyperbolicDamping(9.5376e5, 148.3813, 2.0734e4)
    return {
        "Leipe stiffness (2)": _surface(stiffness, {"k1": "N/m", "k2": ""}, 0.0401),
        "Leipe damping (3)": _surface(damping, {"d1": "N^2 s/m", "d2": "N", "d3": "N s/m"}, 0.0451),
        "drive record (8)": (drive.residual, drive.model, drive.space),
        "drive's frequency responses (8)": (responses.residual, responses.model, responses.space),
    }


def swarm_ledger(*, particles: int = 40, iterations: int = 400, starts: int = 8, seed: int = 1) -> list[Ledger]:
    """Run all methods on all problems.

    Args:
        particles: of the swarm.
        iterations: at most, of the swarm.
        starts: of SLSQP and Levenberg-Marquardt, all of which are paid for.
        seed: of the swarm.
    """
    rows = []
    for name, (residual, model, space) in problems().items():
        gradient_rows, target = [], np.inf
        for solver in (BoundedLevenbergMarquardt(), SLSQP()):
            for _ in range(2):  # the first compiles
                clock = time.perf_counter()
                result = multistart(residual, model, space, starts=starts, solver=solver, max_steps=300, width=8)
                seconds = time.perf_counter() - clock
            paid = int((result.steps + 1).sum()) * (len(space) + 1)
            gradient_rows.append((type(solver).__name__, paid, seconds, float(np.nanmin(result.costs))))
            target = min(target, gradient_rows[-1][3])
        for method, paid, seconds, cost in gradient_rows:
            rows.append(Ledger(name, f"{method}, {starts} starts", paid, seconds, cost <= CLOSE * target))
        rows.append(_swarm(name, residual, model, space, target, particles, iterations, seed))
    return rows


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


def _swarm(name, residual, model, space, target, particles, iterations, seed) -> Ledger:
    objective = Objective(residual, model, space)
    costs = jax.jit(lambda o, x: jax.vmap(lambda v: 0.5 * jnp.sum(o(v)[0] ** 2))(x))
    bounds = (np.asarray(space.lower), np.asarray(space.upper))
    costs(objective, jnp.asarray(np.tile(bounds[0], (particles, 1)))).block_until_ready()
    paid = 0

    def evaluate(x: np.ndarray) -> np.ndarray:
        nonlocal paid
        paid += len(x)
        found = np.nan_to_num(np.asarray(costs(objective, jnp.asarray(x))), nan=np.inf)
        if found.min() <= CLOSE * target:
            raise _Reached
        return found

    np.random.seed(seed)  # noqa: NPY002 (pyswarms draws from NumPy's global generator)
    options = {"c1": 1.49445, "c2": 1.49445, "w": 0.729}  # Clerc and Kennedy's constriction
    with _pyswarms() as pyswarms:
        swarm = pyswarms.single.GlobalBestPSO(particles, len(space), options, bounds=bounds)
        clock = time.perf_counter()
        try:
            swarm.optimize(evaluate, iterations, verbose=False)
            reached = False
        except _Reached:
            reached = True
        seconds = time.perf_counter() - clock
    return Ledger(name, f"swarm of {particles}", paid, seconds, reached)


def as_markdown(rows: list[Ledger]) -> str:
    """Table of the ledger."""
    lines = [
        "## Swarm ledger: the price of the same error",
        "",
        f"Until the cost is within {100 * (CLOSE - 1):.1g} % of the best known; a Jacobian counts one per parameter.",
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
