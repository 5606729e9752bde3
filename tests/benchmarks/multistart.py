"""Throughput of many starts of one drive fit: a batch, SciPy's loop over our residual, and SciPy throughout."""

import time
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import least_squares

from fitting.multistart import multistart
from fitting.objective import Objective
from fitting.solve import linearised
from fitting.starts import sample_starts
from tests.benchmarks.drive_case import DriveCase, drive_case, scipy_residual

COUNTS = (1, 10, 100, 1000, 10000)


class Speed(NamedTuple):
    """One way to run many starts."""

    name: str
    """What ran."""
    starts: int
    """Number of starts."""
    seconds: float
    """Time that they took, compiled before [s]."""
    found: float
    """Share of starts that reached the best cost to 0.1 %."""
    steps: float
    """Evaluations per start."""

    @property
    def rate(self) -> float:
        """Fits per second."""
        return self.starts / self.seconds


def multistart_speeds(
    counts: tuple[int, ...] = COUNTS, *, loop: int = 100, throughout: int = 3, samples: int = 300
) -> list[Speed]:
    """Time the batch at several sizes, and both peers on the first starts of the largest.

    Args:
        counts: numbers of starts.
        loop: starts that SciPy's loop over our residual runs.
        throughout: starts that SciPy with its own simulation runs; some seconds each.
        samples: of the record.
    """
    case = drive_case(samples)
    vectors = sample_starts(case.space, max(counts))
    values = np.asarray(jax.vmap(case.space.unscaled)(jnp.asarray(vectors)))
    multistart(case.residual, case.model, case.space, starts=values[:1])  # compiles
    rows, best = [], np.inf
    for count in counts:
        clock = time.perf_counter()
        result = multistart(case.residual, case.model, case.space, starts=values[:count])
        seconds = time.perf_counter() - clock
        best = min(best, float(np.nanmin(result.costs)))
        found = float(np.mean(result.costs <= 1.001 * best))
        rows.append(Speed("our batch", count, seconds, found, float(result.steps.mean()) + 1))
    rows.append(_ours_in_a_loop(case, vectors[:loop], best))
    rows.append(_scipy_throughout(case, vectors[:throughout], best))
    return rows


def _ours_in_a_loop(case: DriveCase, starts: np.ndarray, best: float) -> Speed:
    """`scipy.optimize.least_squares` over our compiled residual and Jacobian."""
    objective = Objective(case.residual, case.model, case.space)
    residual = jax.jit(lambda o, x: o(x)[0])
    jacobian = jax.jit(lambda o, x: linearised(o, x)[0])
    for function in (residual, jacobian):
        function(objective, jnp.asarray(starts[0])).block_until_ready()
    return _loop(
        "SciPy TRF over our residual and Jacobian",
        starts,
        best,
        lambda x: np.asarray(residual(objective, x)),
        lambda x: np.asarray(jacobian(objective, x)),
        case,
    )


def _scipy_throughout(case: DriveCase, starts: np.ndarray, best: float) -> Speed:
    """`least_squares` with finite differences over `solve_ivp`."""
    return _loop("SciPy TRF, solve_ivp, differences", starts, best, lambda x: scipy_residual(case, x), "2-point", case)


def _loop(name: str, starts: np.ndarray, best: float, residual, jacobian, case: DriveCase) -> Speed:
    bounds = (np.asarray(case.space.lower), np.asarray(case.space.upper))
    costs, evaluations = [], []
    clock = time.perf_counter()
    for start in starts:
        answer = least_squares(residual, start, jac=jacobian, bounds=bounds, x_scale="jac", max_nfev=100)
        costs.append(answer.cost)
        evaluations.append(answer.nfev)
    seconds = time.perf_counter() - clock
    found = float(np.mean(np.asarray(costs) <= 1.001 * best))
    return Speed(name, len(starts), seconds, found, float(np.mean(evaluations)))


def as_markdown(rows: list[Speed]) -> str:
    """Table of the speeds, with the ratio of throughputs to the batch of 1,000 (or the largest)."""
    ours = [row for row in rows if row.name == "our batch"]
    reference = next((row for row in ours if row.starts == 1000), ours[-1])
    lines = [
        "## Many starts of an eight-parameter drive fit",
        "",
        "| | starts | seconds | fits/s | reached the best | evaluations per start | batch is faster by |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        lines.append(
            f"| {row.name} | {row.starts} | {row.seconds:.2f} | {row.rate:.3g} | {100 * row.found:.0f} % | "
            f"{row.steps:.1f} | {reference.rate / row.rate:.3g} |"
        )
    return "\n".join(lines) + "\n"


def as_dictionary(rows: list[Speed]) -> list[dict]:
    """The rows for `benchmarks.json`."""
    return [{**row._asdict(), "rate": row.rate} for row in rows]
