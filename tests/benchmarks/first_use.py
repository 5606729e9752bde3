"""First use: how long imports take beside JAX and diffrax alone, and a new process until its first result."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tests.benchmarks.entrant import Spread
from tests.benchmarks.first_use_tasks import TASKS, TICKS, simulation
from tests.benchmarks.summary import SummaryRow, ratio_row

_ROOT = Path(__file__).parents[2]
_TASKS = "tests.benchmarks.first_use_tasks"
_TIMEOUT = 300.0
_NOTEBOOK = ("simulation", "drives", "control", "linear", "parameters", "references", "laws", "modal", "sweep")
ALONE = "jax, diffrax"
"""What the imports are compared with."""
IMPORTS = {
    ALONE: "import jax, diffrax",
    "twin": "import twin",
    "twin, all that a notebook needs": f"import {', '.join(f'twin.{name}' for name in _NOTEBOOK)}",
    "fitting.fit": "import fitting.fit",
    "sensitivity": "import sensitivity",
    "drivetwin --help": "from fitting.cli import main\ntry:\n    main(['--help'])\nexcept SystemExit:\n    pass",
}
"""Name and statement of each import."""
GOAL = 2.0
"""Imports should take less than this many times those of jax and diffrax."""
CACHES = ("none", "empty", "filled")
"""Without compile cache; with an empty one, which is filled; with what the process before has left."""


@dataclass(frozen=True)
class Import:
    """One import in new processes."""

    name: str
    """What is imported."""
    seconds: Spread
    """Its time [s]."""
    ratio: float
    """Its median over that of jax and diffrax alone [-]."""


@dataclass(frozen=True)
class FirstResult:
    """One task in new processes; medians."""

    task: str
    """Name."""
    cache: str
    """State of the compile cache: one of CACHES."""
    imports: float
    """Imports, and model and data made [s]."""
    trace: float
    """JAX tracing and lowering what is to be compiled [s]."""
    compile: float
    """XLA compiling, or reading from the cache [s]."""
    run: float
    """A second call, that is the task itself [s]."""
    total: Spread
    """From the first import to the first result [s]."""
    taken: int
    """Programs taken from the cache."""
    difference: float
    """Largest relative difference of the result from that without cache [-]."""


@dataclass(frozen=True)
class FirstUse:
    """The section."""

    imports: list[Import]
    """One row for each of IMPORTS."""
    results: list[FirstResult]
    """One row for each task and each state of the cache."""


def first_use(rounds: int = 5, imports: Mapping[str, str] = IMPORTS, tasks: Sequence[str] = tuple(TASKS)) -> FirstUse:
    """Measure everything in new processes, one after the other, in turns.

    Args:
        rounds: processes for each row.
        imports: statements by name; with that of jax and diffrax alone.
        tasks: names of tasks.
    """
    seconds: dict[str, list[float]] = {name: [] for name in imports}
    for _ in range(rounds):
        for name, statement in imports.items():
            code = f"import time\nbegin = time.perf_counter()\n{statement}\nprint(time.perf_counter() - begin)"
            seconds[name].append(float(_run("-c", code).splitlines()[-1]))
    alone = float(np.median(seconds[ALONE]))
    rows = [Import(name, Spread.of(times), float(np.median(times)) / alone) for name, times in seconds.items()]

    with tempfile.TemporaryDirectory() as folder:
        record = Path(folder) / "record.npz"
        np.savez(record, times=np.arange(TICKS) * 1e-3, position=np.asarray(simulation("")()))
        runs: dict[tuple[str, str], list[dict[str, Any]]] = {(task, cache): [] for task in tasks for cache in CACHES}
        for turn in range(rounds):
            for task, cache in runs:
                place = [] if cache == "none" else [str(Path(folder) / f"{task}-{turn}")]
                runs[task, cache].append(json.loads(_run("-m", _TASKS, task, str(record), *place)))
    return FirstUse(rows, [_result(*key, runs) for key in runs])


def summary_rows(found: FirstUse) -> list[SummaryRow]:
    """The ratios for the summary: prices of imports, and what the filled cache saves."""
    (alone,) = (row for row in found.imports if row.name == ALONE)
    rows = [
        ratio_row(f"import: {row.name}", ALONE, row.seconds.turns, alone.seconds.turns, "nothing to compare", most=GOAL)
        for row in found.imports
        if row is not alone
    ]
    by_cache = {(row.task, row.cache): row for row in found.results}
    for task in dict.fromkeys(row.task for row in found.results):
        without, filled = by_cache[task, "none"], by_cache[task, "filled"]
        agreement = f"to {filled.difference:.0e}"
        times = without.total.turns, filled.total.turns
        rows.append(ratio_row(f"first {task}, compile cache filled", "without compile cache", *times, agreement))
    return rows


def as_markdown(found: FirstUse) -> str:
    """The report's section."""
    worst = max(found.imports, key=lambda row: row.ratio)
    verdict = "hit" if worst.ratio < GOAL else "miss"
    lines = [
        "## First use",
        "",
        f"Imports in new processes, files in the system's cache, in turns. Goal: below {GOAL:g} times jax and diffrax "
        f"alone; the slowest, {worst.name}, takes {worst.ratio:.2f} times: {verdict}.",
        "",
        "| import | min / median / max [s] (processes) | ratio |\n|---|---|---|",
        *(f"| {row.name} | {_spread(row.seconds)} | {row.ratio:.2f} |" for row in found.imports),
        "",
        "From the first import to the first result, each in a new process (medians). Simulation: a closed loop through "
        f"a move, {TICKS} ticks. Fit: its mass and friction from the record, with intervals. The compile cache saves "
        "compilation; imports and JAX's tracing remain. `run` is what a second call takes.",
        "",
        "| task | compile cache | import [s] | trace [s] | compile or read [s] | run [s] "
        "| total min / median / max [s] (processes) | programs taken | difference |",
        "|---|---|---|---|---|---|---|---|---|",
        *(
            f"| {row.task} | {row.cache} | {row.imports:.2f} | {row.trace:.2f} | {row.compile:.2f} | {row.run:.3f} "
            f"| {_spread(row.total)} | {row.taken} | {row.difference:.1g} |"
            for row in found.results
        ),
        "",
    ]
    return "\n".join(lines)


def as_dictionary(found: FirstUse) -> dict[str, Any]:
    """The same as plain numbers and names, times in seconds."""
    return asdict(found)


def _run(*arguments: str) -> str:
    """What a new Python prints; no setting of a cache reaches it."""
    kept = {name: value for name, value in os.environ.items() if "COMPILATION_CACHE" not in name}
    kept.pop("DRIVETWIN_COMPILE_CACHE", None)
    kept.pop("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", None)
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=_ROOT,
        env=kept,
        capture_output=True,
        text=True,
        timeout=_TIMEOUT,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(f"python {' '.join(arguments)} failed:\n{done.stderr}")
    return done.stdout


def _result(task: str, cache: str, runs: Mapping[tuple[str, str], list[dict[str, Any]]]) -> FirstResult:
    here = runs[task, cache]
    right = np.asarray(runs[task, "none"][0]["value"])
    worst = max(float(np.max(np.abs(np.asarray(run["value"]) - right))) for run in here)
    parts = [float(np.median([run[part] for run in here])) for part in ("import", "trace", "compile", "run")]
    total = Spread.of([run["total"] for run in here])
    taken = min(run["taken"] for run in here)
    return FirstResult(task, cache, *parts, total, taken, worst / float(np.max(np.abs(right))))


def _spread(spread: Spread) -> str:
    return " / ".join(f"{t:.2f}" for t in (spread.min, spread.median, spread.max)) + f" ({spread.calls})"
