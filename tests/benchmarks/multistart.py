"""Throughput of many starts of one drive fit: a batch, SciPy's loop over our residual, and SciPy throughout."""

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import least_squares

from fitting.multistart import multistart
from fitting.objective import Objective
from fitting.solve import linearised
from fitting.starts import sample_starts
from tests.benchmarks.drive_case import Case, drive_case
from tests.benchmarks.frequency_case import frequency_case

COUNTS = (1, 10, 100, 1000, 10000)
COMPARED = 1000
"""Starts of the batch that the peers are compared with."""
CASES = {
    "drive record, 300 samples": (drive_case, 3),
    "drive's frequency responses, 4 of 100 lines": (frequency_case, 30),
}
"""The cases, and how many starts SciPy with its own model runs: some seconds."""


class Speed(NamedTuple):
    """One way to run many starts."""

    name: str
    """What ran."""
    starts: int
    """Number of starts."""
    seconds: float
    """Time that they took, compiled before: the median of all rounds [s]."""
    found: float
    """Share of starts that reached the best cost to 0.1 %."""
    steps: float
    """Evaluations per start."""

    @property
    def rate(self) -> float:
        """Fits per second."""
        return self.starts / self.seconds


def multistart_speeds(
    case: Case, counts: tuple[int, ...] = COUNTS, *, loop: int = 60, throughout: int = 3, rounds: int = 3
) -> list[Speed]:
    """Time the batch at several sizes, and both peers on its first starts, in turns.

    Args:
        case: what is fitted.
        counts: numbers of starts.
        loop: starts that SciPy's loop over our residual runs.
        throughout: starts that SciPy with its own model runs.
        rounds: turns, of which the median counts; sizes beyond the one compared run once.
    """
    vectors = sample_starts(case.space, max(counts))
    values = case.space.unscaled_rows(vectors)
    multistart(case.residual, case.model, case.space, starts=values[:1])  # compiles
    residual, jacobian = _compiled(case, vectors[0])
    best, runs = np.inf, {}
    for turn in range(rounds):
        for count in counts:
            if count > COMPARED and turn > 0:
                continue
            clock = time.perf_counter()
            result = multistart(case.residual, case.model, case.space, starts=values[:count])
            seconds = time.perf_counter() - clock
            best = min(best, float(np.nanmin(result.costs)))
            runs.setdefault(("our batch", count), []).append((seconds, result.costs, result.steps + 1))
        name = "SciPy TRF over our residual and Jacobian"
        runs.setdefault((name, loop), []).append(_loop(vectors[:loop], residual, jacobian, case))
    name = "SciPy TRF, its own model, differences"
    runs[name, throughout] = [_loop(vectors[:throughout], case.throughout, "2-point", case)]
    rows = []
    for (name, count), turns in runs.items():
        seconds = float(np.median([t[0] for t in turns]))
        found = float(np.mean(turns[0][1] <= 1.001 * best))
        rows.append(Speed(name, count, seconds, found, float(np.mean(turns[0][2]))))
    return rows


def _compiled(case: Case, start: np.ndarray) -> tuple[Callable, Callable]:
    """Our residual and its Jacobian as SciPy wants them."""
    objective = Objective(case.residual, case.model, case.space)
    residual = jax.jit(lambda o, x: o(x)[0])
    jacobian = jax.jit(lambda o, x: linearised(o, x)[0])
    for function in (residual, jacobian):
        function(objective, jnp.asarray(start)).block_until_ready()
    return lambda x: np.asarray(residual(objective, x)), lambda x: np.asarray(jacobian(objective, x))


def _loop(starts: np.ndarray, residual: Callable, jacobian: Any, case: Case) -> tuple[float, np.ndarray, np.ndarray]:
    """Seconds, costs and evaluations of a plain loop over the starts."""
    bounds = (np.asarray(case.space.lower), np.asarray(case.space.upper))
    clock = time.perf_counter()
    answers = [
        least_squares(residual, start, jac=jacobian, bounds=bounds, x_scale="jac", max_nfev=100) for start in starts
    ]
    seconds = time.perf_counter() - clock
    return seconds, np.asarray([a.cost for a in answers]), np.asarray([a.nfev for a in answers])


def one_bad_start(case: Case, starts: int = COMPARED, rounds: int = 3) -> float:
    """How much longer a batch takes with one start that is not finite: median ratio of runs in turns.

    Args:
        case: what is fitted.
        starts: in the batch.
        rounds: turns.
    """
    good = case.space.unscaled_rows(sample_starts(case.space, starts))
    bad = good.copy()
    bad[starts // 2] = np.nan
    ratios = []
    for _ in range(rounds):
        seconds = []
        for values in (good, bad):
            clock = time.perf_counter()
            multistart(case.residual, case.model, case.space, starts=values)
            seconds.append(time.perf_counter() - clock)
        ratios.append(seconds[1] / seconds[0])
    return float(np.median(ratios))


def all_cases() -> dict[str, tuple[list[Speed], float]]:
    """Speeds of every case, and what one bad start among a thousand costs."""
    found = {}
    for name, (make, throughout) in CASES.items():
        case = make()
        found[name] = (multistart_speeds(case, throughout=throughout), one_bad_start(case))
    return found


def as_markdown(cases: dict[str, tuple[list[Speed], float]]) -> str:
    """Tables of the speeds, with the ratio of throughputs to the batch of 1,000 (or the largest)."""
    lines = ["## Many starts of an eight-parameter drive fit", ""]
    for name, (rows, bad) in cases.items():
        ours = [row for row in rows if row.name == "our batch"]
        reference = next((row for row in ours if row.starts == COMPARED), ours[-1])
        lines += [
            f"### {name}",
            "",
            "| | starts | seconds | fits/s | reached the best | evaluations per start | batch is faster by |",
            "|---|---|---|---|---|---|---|",
        ]
        for row in rows:
            lines.append(
                f"| {row.name} | {row.starts} | {row.seconds:.2f} | {row.rate:.3g} | {100 * row.found:.0f} % | "
                f"{row.steps:.1f} | {reference.rate / row.rate:.3g} |"
            )
        lines += [
            "",
            f"One start that is not finite among {COMPARED} makes the batch take {bad:.2f} times as long.",
            "",
        ]
    return "\n".join(lines)


def as_dictionary(cases: dict[str, tuple[list[Speed], float]]) -> dict:
    """The rows for `benchmarks.json`."""
    return {
        name: {"rows": [{**row._asdict(), "rate": row.rate} for row in rows], "one_bad_start": bad}
        for name, (rows, bad) in cases.items()
    }
