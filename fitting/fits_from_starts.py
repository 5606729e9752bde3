"""Fits from many starts as a batch, which can be stored, resumed, and sent to workers."""

import dataclasses
from collections.abc import Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np

from fitting.lanes import Ended, Keep, Task, solve_lanes
from fitting.objective import Objective
from fitting.solve import Solved, Solver
from fitting.solvers.stop import STOPS
from twin.batch import batched
from twin.batch_result import RAISED, SAMPLE_IS_NAN

_CHUNK = 128
"""Starts between two looks at the store: so many that few lanes wait for the last of them."""


@dataclasses.dataclass(eq=False)
class FitsFromStarts:
    """Fits that differ in their start alone."""

    objective: Objective
    """What is minimised."""
    solver: Solver
    """The solver."""
    max_steps: int
    """Steps after which a fit is given up."""
    width: int = dataclasses.field(metadata={"changes_results": False})
    """Fits that run in step."""
    threads: int | None = dataclasses.field(metadata={"changes_results": False})
    """Sets of lanes that run side by side."""
    keep: Keep | None = dataclasses.field(default=None, metadata={"changes_results": False})
    """Whose whole outcome to keep, see `solve_lanes`; not where the fits run in workers."""
    kept: dict[int, Solved] = dataclasses.field(default_factory=dict, metadata={"changes_results": False})
    """Whole outcomes by the number of the start, of the fits that ran in this process."""

    def run(self, starts: np.ndarray, *, store: str | Path | None, executor: Executor | None, progress: bool) -> Ended:
        """Fit from all starts.

        Args:
            starts: scaled vectors (starts, parameters); NaN for those that cannot be fitted.
            store: folder that keeps the ends.
            executor: where the fits run; None for this process.
            progress: show a bar.

        Returns:
            Where the fits ended, with the whole outcomes of those in `kept`.
        """
        count = len(starts)
        found = batched(
            self,
            {"number": np.arange(count), "start": starts},
            mode="chunk",
            chunk_size=count if store is None and executor is None else min(_CHUNK, count),
            store=store,
            executor=executor,
            progress=progress,
        )
        if not found.outputs:
            blank = np.full(starts.shape, np.nan)
            stop = np.full(count, "not_finite", dtype=object)
            return Ended(blank, blank[:, 0], stop, np.zeros(count, int), np.isinf(blank), {})
        stop = np.array(STOPS, dtype=object)[found["stop"]]
        stop[np.isin(found.status, (RAISED, SAMPLE_IS_NAN))] = "not_finite"
        return Ended(found["vector"], found["cost"], stop, found["steps"], found["active"], self.kept)

    def outcomes(self, starts: np.ndarray, chosen: Sequence[int]) -> dict[int, Solved]:
        """Whole outcomes of some fits; those that are not kept are fitted again, to the same bits.

        Args:
            starts: as in `run`.
            chosen: numbers of the starts.
        """
        missing = np.array([i for i in chosen if i not in self.kept], dtype=int)
        if missing.size:
            self.keep = lambda cost, best: True
            self({"number": missing, "start": starts[missing]})
        return {i: self.kept[i] for i in chosen}

    def __call__(self, rows: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Where the fits of a chunk ended.

        Args:
            rows: "number" (fits,) and "start" (fits, parameters); a number that comes twice is fitted once.
        """
        numbers, first, back = np.unique(rows["number"], return_index=True, return_inverse=True)
        starts = rows["start"][first]
        space = self.objective.space
        bounds = [np.tile(np.asarray(side), (len(starts), 1)) for side in (space.lower, space.upper)]
        ended = solve_lanes(
            self.objective,
            Task(starts, *bounds),
            self.solver,
            max_steps=self.max_steps,
            keep=self.keep,
            width=self.width,
            threads=self.threads,
        )
        self.kept.update({int(numbers[i]): solved for i, solved in ended.kept.items()})
        codes = np.array([STOPS.index(stop) for stop in ended.stop])
        ends = {"vector": ended.vector, "cost": ended.cost, "stop": codes, "steps": ended.steps, "active": ended.active}
        return {name: values[back] for name, values in ends.items()}

    def __getstate__(self) -> dict[str, Any]:
        """What a worker needs."""
        return {**self.__dict__, "keep": None, "kept": {}}
