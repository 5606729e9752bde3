"""SLSQP against SciPy's: problems solved and evaluations needed, and starts per second as one batch against a loop."""

import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jax import Array

from fitting.solvers.slsqp import SLSQP
from tests.benchmarks.entrant import Spread
from tests.benchmarks.summary import SummaryRow, ratio_row
from tests.problems.hock_schittkowski import PROBLEMS
from tests.problems.nonlinear_programme import NonlinearProgramme, programme
from tests.problems.programme_runs import Run, SlsqpRunner, judged, minimise_by_scipy, run_scipy

_TIGHT = 1e-10


@dataclass(frozen=True)
class Count:
    """How one solver fared over the collection of Hock and Schittkowski."""

    solver: str
    """Name and setting."""
    solved: int
    """Problems brought to the published optimum."""
    false_successes: int
    """Claims of success at points that are infeasible (1e-6) or not stationary (1e-4, relative)."""
    evaluations: float
    """Median over the problems that all solvers solve."""
    mean_evaluations: float
    """Mean over the same problems."""


@dataclass(frozen=True)
class Throughput:
    """One problem from many starts."""

    problem: str
    """Name."""
    starts: int
    """Number of starts."""
    batch: Spread
    """One compiled batch of ours [s]."""
    compile: float
    """Its compilation [s]."""
    loop: float
    """SciPy's SLSQP over the same starts, on compiled values and derivatives [s]."""
    batch_solved: int
    """Starts from which ours reaches the optimum, to 1e-6."""
    loop_solved: int
    """Starts from which SciPy does."""

    @property
    def ratio(self) -> float:
        """SciPy's time over ours, without compilation."""
        return self.loop / self.batch.min


def counts() -> list[Count]:
    """Ours and SciPy's over the collection, SciPy's at its default tolerance and at ours."""
    ours = SlsqpRunner()
    solvers: dict[str, Callable[[NonlinearProgramme], Run]] = {
        "twin": ours,
        "SciPy, ftol=1e-6": lambda problem: run_scipy(problem, 1e-6),
        f"SciPy, ftol={_TIGHT:.0e}": lambda problem: run_scipy(problem, _TIGHT),
    }
    runs = {name: {problem.name: solve(problem) for problem in PROBLEMS} for name, solve in solvers.items()}
    common = [p.name for p in PROBLEMS if all(run[p.name].solved for run in runs.values())]
    return [_count(name, run, common) for name, run in runs.items()]


def throughputs(starts: int, rounds: int) -> list[Throughput]:
    """A problem of a textbook and one like a modal fit, from random starts within their bounds.

    Args:
        starts: number of starts.
        rounds: calls of the batch after its compilation.
    """
    textbook = next(problem for problem in PROBLEMS if problem.name == "HS71")
    return [_throughput(problem, starts, rounds) for problem in (textbook, chain())]


def chain() -> NonlinearProgramme:
    """Five springs of a chain of unit masses from its five natural frequencies, its compliance at the end limited.

    The unknowns are logarithms of the springs' stiffnesses, the measured frequencies are those of another chain.
    """
    measured = _frequencies(jnp.asarray([0.3, -0.2, 0.1, 0.4, -0.3])) * np.array([1.01, 0.99, 1.0, 1.01, 0.99])

    def cost(x: Array) -> Array:
        return jnp.sum((_frequencies(x) / measured - 1.0) ** 2)

    # The optimum from a tight run of SciPy's; nothing is published.
    problem = programme(
        "chain of five",
        cost,
        np.zeros(5),
        lower=-1.0,
        upper=1.0,
        inequality=lambda x: [4.5 - jnp.sum(jnp.exp(-x))],
        optimum=0.0,
        solution=np.zeros(5),
    )
    found = run_scipy(problem, 1e-14)
    return problem._replace(optimum=found.value, solution=found.x)


def summary_rows(found: list[Count], speeds: list[Throughput]) -> list[SummaryRow]:
    """The ratios for the summary."""
    ours, *peers = found
    rows = []
    for peer in peers:
        told = f"twin solves {ours.solved}, peer {peer.solved} of {len(PROBLEMS)}"
        name = "Hock and Schittkowski, evaluations (medians)"
        rows.append(ratio_row(name, peer.solver, [peer.evaluations], [ours.evaluations], told, least=1.0))
    for speed in speeds:
        told = f"the optimum from {speed.batch_solved} and {speed.loop_solved} of {speed.starts} starts"
        name = f"{speed.problem} from {speed.starts} starts"
        rows.append(ratio_row(name, "loop of SciPy SLSQP", [speed.loop], speed.batch.turns, told))
    return rows


def as_markdown(found: list[Count], speeds: list[Throughput]) -> str:
    """The report's section."""
    head = ["## Nonlinear programmes", "", f"Hock and Schittkowski's collection, {len(PROBLEMS)} problems:", ""]
    columns = "| solver | solved | false successes | evaluations, median | mean |\n|---|---|---|---|---|"
    rows = [
        f"| {c.solver} | {c.solved} | {c.false_successes} | {c.evaluations:g} | {c.mean_evaluations:.1f} |"
        for c in found
    ]
    speed_columns = (
        "| problem | starts | twin, one batch min / median / max [ms] | compile [s] | SciPy loop [ms] | SciPy / twin "
        "| reach the optimum: twin | SciPy |\n|---|---|---|---|---|---|---|---|"
    )
    speed_rows = [_speed_row(speed) for speed in speeds]
    return "\n".join([*head, columns, *rows, "", "Many starts of one problem:", "", speed_columns, *speed_rows, ""])


def as_dictionary(found: list[Count], speeds: list[Throughput]) -> dict[str, Any]:
    """The same as plain numbers and names, times in seconds."""
    return {
        "hock_schittkowski": [asdict(count) for count in found],
        "throughput": [asdict(speed) | {"ratio": speed.ratio} for speed in speeds],
    }


def _count(name: str, runs: Mapping[str, Run], common: list[str]) -> Count:
    evaluations = [runs[problem].evaluations for problem in common]
    # A minimum without multipliers, such as problem 13's, is no false one.
    false = [
        run for run in runs.values() if run.success and not run.solved and (run.violation > 1e-6 or run.residual > 1e-4)
    ]
    solved = sum(run.solved for run in runs.values())
    return Count(name, solved, len(false), float(np.median(evaluations)), float(np.mean(evaluations)))


def _throughput(problem: NonlinearProgramme, starts: int, rounds: int) -> Throughput:
    points = np.random.default_rng(1).uniform(problem.lower, problem.upper, (starts, problem.start.size))
    options: dict[str, Any] = {"lower": problem.lower, "upper": problem.upper}
    for name in ("equality", "inequality"):
        function = getattr(problem, name)
        if function is not None:
            options[name] = lambda y, args, function=function: function(y)

    def solve(start: Array) -> tuple[Array, Array]:
        found = optx.minimise(
            lambda y, args: problem.objective(y), SLSQP(), start, options=options, max_steps=200, throw=False
        )
        return found.state.here.value, found.state.violation

    begin = time.perf_counter()
    batch = jax.jit(jax.vmap(solve)).lower(points).compile()
    compiling = time.perf_counter() - begin
    values, violations = (np.asarray(part) for part in batch(points))
    times = []
    for _ in range(rounds):
        begin = time.perf_counter()
        jax.block_until_ready(batch(points))
        times.append(time.perf_counter() - begin)

    minimise_by_scipy(problem, _TIGHT)  # compiles the functions
    begin = time.perf_counter()
    loop = [minimise_by_scipy(problem._replace(start=point), _TIGHT) for point in points]
    looping = time.perf_counter() - begin
    reached = sum(judged(problem, answer.x, answer.nfev, 0, "", answer.success).solved for answer, _ in loop)
    close = np.abs(values - problem.optimum) <= 1e-6 * max(1.0, abs(problem.optimum))
    solved = int(np.sum(close & (violations <= 1e-6)))
    return Throughput(problem.name, starts, Spread.of(times), compiling, looping, solved, reached)


def _frequencies(x: Array) -> Array:
    stiffness = jnp.exp(x)
    following = jnp.append(stiffness[1:], 0.0)
    matrix = jnp.diag(stiffness + following) - jnp.diag(stiffness[1:], 1) - jnp.diag(stiffness[1:], -1)
    return jnp.sqrt(jnp.linalg.eigvalsh(matrix))


def _count_row(count: Count) -> str:
    numbers = f"{count.solved} | {count.false_successes} | {count.evaluations:g} | {count.mean_evaluations:.1f}"
    return f"| {count.solver} | {numbers} |"


def _speed_row(speed: Throughput) -> str:
    spread = speed.batch
    times = " / ".join(f"{1e3 * t:.4g}" for t in (spread.min, spread.median, spread.max))
    return (
        f"| {speed.problem} | {speed.starts} | {times} | {speed.compile:.1f} | {1e3 * speed.loop:.4g} "
        f"| {speed.ratio:.3g} | {speed.batch_solved} | {speed.loop_solved} |"
    )
