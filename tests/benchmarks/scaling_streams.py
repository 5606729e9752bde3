"""One study of moves by one thread, by two, and by two processes that hold a core each: the same results, and times."""

import contextlib
import time
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from typing import Any, NamedTuple

import jax
import numpy as np

from tests.benchmarks import rack_case
from tests.benchmarks.scaling import move
from tests.benchmarks.summary import SummaryRow, difference, ratio_row, refused_row
from twin.batch import batched
from twin.executors import local_processes

SAME = 1e-12
"""Largest difference of results, relative to the largest."""
ONE, TWO, PROCESSES = "one thread", "two threads", "two processes"


class Streams(NamedTuple):
    """Times of one study by several executors."""

    variants: int
    seconds: dict[str, list[float]]
    """Time of each turn, compiled before [s]."""
    difference: dict[str, float]
    """Largest difference from the results of one thread."""


def streams(variants: int, rounds: int = 3) -> Streams:
    """Run the study by each executor in turns.

    Args:
        variants: samples of the study.
        rounds: turns.
    """
    one, samples = move(), rack_case.variants(variants)
    with _executors() as executors:

        def run(executor: Executor) -> np.ndarray:
            return batched(one, samples, chunk_size=32, executor=executor, progress=False).value

        # The second call meets the processes that the first one may have left out.
        answers = {name: [run(executor) for _ in range(2)][-1] for name, executor in executors.items()}
        seconds: dict[str, list[float]] = {name: [] for name in executors}
        for _ in range(rounds):
            for name, executor in executors.items():
                clock = time.perf_counter()
                run(executor)
                seconds[name].append(time.perf_counter() - clock)
    return Streams(variants, seconds, {name: difference(answer, answers[ONE]) for name, answer in answers.items()})


@contextlib.contextmanager
def _executors() -> Iterator[dict[str, Executor]]:
    with contextlib.ExitStack() as stack:
        found: dict[str, Executor] = {
            ONE: stack.enter_context(ThreadPoolExecutor(1)),
            TWO: stack.enter_context(ThreadPoolExecutor(2)),
        }
        # Processes would each want the accelerator's memory for themselves.
        if jax.default_backend() == "cpu":
            found[PROCESSES] = stack.enter_context(local_processes(2))
        yield found


def summary_rows(found: Streams) -> list[SummaryRow]:
    """What more streams gain over one thread."""
    rows = []
    for name, seconds in found.seconds.items():
        what, error = f"{found.variants} moves by {name}", found.difference[name]
        if name != ONE and error <= SAME:
            rows.append(ratio_row(what, ONE, found.seconds[ONE], seconds, f"to {error:.0e}"))
        elif name != ONE:
            rows.append(refused_row(what, ONE, f"differs by {error:.1e}, limit {SAME:.0e}"))
    return rows


def as_markdown(found: Streams) -> str:
    """Table of the streams."""
    lines = [
        "### Streams side by side",
        "",
        f"{found.variants} variants of the move in chunks of 32, compiled before.",
        "",
        "| by | median [s] | range of turns [s] | variants per second | difference from one thread |",
        "|---|---|---|---|---|",
    ]
    for name, times in found.seconds.items():
        median = float(np.median(times))
        lines.append(
            f"| {name} | {median:.3g} | {min(times):.3g} to {max(times):.3g} | {found.variants / median:.3g} "
            f"| {found.difference[name]:.0e} |"
        )
    return "\n".join([*lines, ""])


def as_dictionary(found: Streams) -> dict[str, Any]:
    """The same for `benchmarks.json`."""
    return found._asdict()
