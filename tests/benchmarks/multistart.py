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
from tests.benchmarks.summary import SummaryRow, difference, ratio_row, refused_row

BATCH, LOOP = "our batch", "SciPy TRF over our residual and Jacobian"
THROUGHOUT = "SciPy TRF, its own model, differences"
GOALS = {LOOP: 10.0, THROUGHOUT: 100.0}
"""Least ratio of fits per second of the batch to a peer's."""
COUNTS = (1, 10, 100, 1000, 10000)
SAME = 1e-3
"""Difference of residuals, relative to the largest entry, up to which SciPy's own model is the same."""
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
    turns: list[float]
    """Time in each round [s]; none for a peer that gives another residual, and so is not timed."""

    @property
    def rate(self) -> float:
        """Fits per second."""
        return self.starts / self.seconds


class Price(NamedTuple):
    """What a start that is not finite costs the batch it is in."""

    bad: list[float]
    """Time of the batch with it in each round [s]."""
    good: list[float]
    """Time of the batch without it [s]."""
    unchanged: bool
    """Whether the costs of all other starts are the same to the last bit."""

    @property
    def ratio(self) -> float:
        """Median over the rounds [-]."""
        return float(np.median(np.divide(self.bad, self.good)))


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
            runs.setdefault((BATCH, count), []).append((seconds, result.costs, result.steps + 1))
        runs.setdefault((LOOP, loop), []).append(_loop(vectors[:loop], residual, jacobian, case))
    error = residual_difference(case, vectors[:8], residual)
    if error <= SAME:
        runs[THROUGHOUT, throughout] = [_loop(vectors[:throughout], case.throughout, "2-point", case)]
    rows = []
    for (name, count), turns in runs.items():
        seconds = float(np.median([t[0] for t in turns]))
        found = float(np.mean(turns[0][1] <= 1.001 * best))
        rows.append(Speed(name, count, seconds, found, float(np.mean(turns[0][2])), [t[0] for t in turns]))
    if error > SAME:
        rows.append(Speed(THROUGHOUT, throughout, np.nan, 0.0, 0.0, []))
    return rows


def residual_difference(case: Case, vectors: np.ndarray, residual: Callable) -> float:
    """Difference of SciPy's own model from ours, relative to the residual's largest entry: median over some points.

    Not the largest, as our constant steps, fine enough for the drive, are less so at the stiffest corner of the bounds.

    Args:
        case: what is fitted.
        vectors: scaled parameters at which the residuals are compared.
        residual: ours of such a vector.
    """
    return float(np.median([difference(np.asarray(case.throughout(v)), residual(v)) for v in vectors]))


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


def one_bad_start(case: Case, starts: int = COMPARED, rounds: int = 3) -> "Price":
    """How much longer a batch takes with one start that is not finite.

    Args:
        case: what is fitted.
        starts: in the batch.
        rounds: turns.
    """
    good = case.space.unscaled_rows(sample_starts(case.space, starts))
    bad = good.copy()
    bad[starts // 2] = np.nan
    others = np.arange(starts) != starts // 2
    turns, unchanged = [], True
    for _ in range(rounds):
        seconds, costs = [], []
        for values in (good, bad):
            clock = time.perf_counter()
            result = multistart(case.residual, case.model, case.space, starts=values)
            seconds.append(time.perf_counter() - clock)
            costs.append(result.costs[others])
        turns.append((seconds[1], seconds[0]))
        unchanged = unchanged and bool(np.array_equal(*costs, equal_nan=True))
    return Price(*map(list, zip(*turns, strict=True)), unchanged)


def all_cases() -> dict[str, tuple[list[Speed], Price]]:
    """Speeds of every case, and the price of one bad start among a thousand."""
    found = {}
    for name, (make, throughout) in CASES.items():
        case = make()
        found[name] = (multistart_speeds(case, throughout=throughout), one_bad_start(case))
    return found


def summary_rows(cases: dict[str, tuple[list[Speed], Price]]) -> list[SummaryRow]:
    """The ratios for the summary, in fits per second of the batch of 1,000 (or the largest)."""
    rows = []
    for name, (speeds, bad) in cases.items():
        batch = compared_batch(speeds)
        ours = [t / batch.starts for t in batch.turns]
        for peer in (speed for speed in speeds if speed.name in (LOOP, THROUGHOUT)):
            if not peer.turns:
                told = f"its residual differs, limit {SAME:.0e}"
                rows.append(refused_row(f"{batch.starts} starts, {name}", peer.name, told, least=GOALS[peer.name]))
                continue
            told = f"{100 * batch.found:.0f} % and {100 * peer.found:.0f} % reach the best cost to 0.1 %"
            what, theirs = f"{batch.starts} starts, {name}", [t / peer.starts for t in peer.turns]
            rows.append(ratio_row(what, peer.name, theirs, ours, told, least=GOALS[peer.name]))
        told = f"others the same to the bit: {'yes' if bad.unchanged else 'no'}"
        what = f"one bad start among {COMPARED}, {name}"
        rows.append(ratio_row(what, "batch without it: a price", bad.bad, bad.good, told, most=1.5))
    return rows


def compared_batch(speeds: list[Speed]) -> Speed:
    """The batch that the peers are compared with: that of 1,000 or the largest."""
    ours = [speed for speed in speeds if speed.name == BATCH]
    return next((speed for speed in ours if speed.starts == COMPARED), ours[-1])


def as_markdown(cases: dict[str, tuple[list[Speed], Price]]) -> str:
    """Tables of the speeds, with the ratio of throughputs to the batch of 1,000 (or the largest)."""
    lines = ["## Many starts of an eight-parameter drive fit", ""]
    for name, (rows, bad) in cases.items():
        reference = compared_batch(rows)
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
            f"One start that is not finite among {COMPARED} makes the batch take {bad.ratio:.2f} times as long.",
            "",
        ]
    return "\n".join(lines)


def as_dictionary(cases: dict[str, tuple[list[Speed], Price]]) -> dict:
    """The rows for `benchmarks.json`."""
    return {
        name: {
            "rows": [{**row._asdict(), "rate": row.rate} for row in rows],
            "one_bad_start": {**bad._asdict(), "ratio": bad.ratio},
        }
        for name, (rows, bad) in cases.items()
    }
