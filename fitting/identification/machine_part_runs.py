"""All runs of the small problems of a machine, each checked against all of its modes."""

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float, Int

from fitting.identification.machine_affine import AffineMachine
from fitting.identification.machine_evidence import Evidence
from fitting.shared_out import shared_out
from fitting.solvers.stop import CONVERGED
from twin.parameters import ParameterSpace

if TYPE_CHECKING:
    import pandas as pd

# Difference of MACXP between the mode followed and the one most alike that is rounding.
_SAME = 1e-7
# Share of its range at which a parameter counts as on its bound.
_BOUND = 1e-4


@dataclasses.dataclass(frozen=True, repr=False)
class PartRuns:
    """Where every run of every problem ended."""

    space: ParameterSpace
    """All unknown parameters."""
    stiffness: Int[np.ndarray, "stiffnesses"]
    """Number in the space of each stiffness."""
    problems: tuple[str, ...]
    """Names of the problems, one for each reference mode at each position."""
    searched: Bool[np.ndarray, "problems stiffnesses"]
    """Which stiffnesses each problem searched; the others were held at random values."""
    start: Float[np.ndarray, "problems runs stiffnesses"]
    """Values at the start [N/m, Nm/rad]."""
    value: Float[np.ndarray, "problems runs stiffnesses"]
    """Values at the end; NaN for a run without one."""
    macxp: Float[np.ndarray, "problems runs"]
    """MACXP of the mode most like the reference mode, from all modes at the end."""
    followed: Float[np.ndarray, "problems runs"]
    """MACXP that the run itself ended with."""
    stop: np.ndarray
    """Why each run ended (problems, runs)."""
    steps: Int[np.ndarray, "problems runs"]
    """Steps of each run, those when it was solved again counted."""
    again: Int[np.ndarray, "problems runs"]
    """How often each run was solved again, as it had failed."""

    @property
    def strayed(self) -> Bool[np.ndarray, "problems runs"]:
        """Runs whose mode is not, among all modes of the machine, the one most like the reference mode."""
        return np.abs(self.macxp - self.followed) > _SAME

    @property
    def failed(self) -> Bool[np.ndarray, "problems runs"]:
        """Runs that did not converge, or that strayed: they count for nothing."""
        return ~np.isin(self.stop, CONVERGED) | self.strayed | ~np.isfinite(self.macxp)

    @property
    def mended(self) -> Bool[np.ndarray, "problems runs"]:
        """Runs that had failed and came right when they were solved again."""
        return (self.again > 0) & ~self.failed

    @property
    def on_bound(self) -> Bool[np.ndarray, "problems runs stiffnesses"]:
        """Which searched stiffnesses ended on a bound."""
        bounds = np.asarray([(p.lower, p.upper) for p in self.space.parameters])[self.stiffness]
        share = (self.value - bounds[:, 0]) / (bounds[:, 1] - bounds[:, 0])
        return ((share < _BOUND) | (share > 1 - _BOUND)) & self.searched[:, None, :]

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths of the stiffnesses."""
        return tuple(self.space.paths[i] for i in self.stiffness)

    def to_dataframe(self) -> "pd.DataFrame":
        """One row per run: its problem, start and end of the stiffnesses searched (others NaN), MACXP, why it ended."""
        import pandas as pd

        problems, runs = self.macxp.shape
        searched = np.repeat(self.searched[:, None], runs, axis=1)
        columns = {"problem": np.repeat(self.problems, runs), "run": np.tile(np.arange(runs), problems)}
        for i, path in enumerate(self.paths):
            columns[path] = np.where(searched, self.value, np.nan)[..., i].ravel()
        last = {"macxp": self.macxp, "stop": self.stop, "steps": self.steps, "again": self.again, "failed": self.failed}
        return pd.DataFrame(columns | {name: array.ravel() for name, array in last.items()})

    def summary(self) -> "pd.DataFrame":
        """One row per problem: how many stiffnesses it searched, its MACXP, and how many of its runs failed."""
        import pandas as pd

        rows = {
            "searched": self.searched.sum(axis=1),
            "macxp median": np.nanmedian(self.macxp, axis=1),
            "macxp best": np.nanmax(self.macxp, axis=1),
            "steps": self.steps.mean(axis=1),
            "solved again": (self.again > 0).sum(axis=1),
            "came right": self.mended.sum(axis=1),
            "strayed": self.strayed.sum(axis=1),
            "failed": self.failed.sum(axis=1),
        }
        return pd.DataFrame(rows, index=pd.Index(self.problems, name="problem"))

    def __repr__(self) -> str:
        count = (
            f"{(self.again > 0).sum()} of {self.failed.size} runs were solved again, {self.mended.sum()} came right. "
        )
        count += f"{self.failed.sum()} runs failed, {self.strayed.sum()} of them on another mode"
        return f"{self.summary().to_string(float_format=lambda x: f'{x:.4g}')}\n{count}."


def best_macxp(
    problems: Sequence[tuple[AffineMachine, Evidence, int]],
    values: Float[np.ndarray, "problems runs stiffnesses"],
    threads: int | None = None,
) -> Float[np.ndarray, "problems runs"]:
    """MACXP of the mode most like each reference mode, out of all modes of the machine.

    Args:
        problems: the machine and the reference modes at the problem's position, and the number of its mode.
        values: stiffnesses of every run.
        threads: problems solved side by side; the number of cores if not given.

    Returns:
        MACXP; NaN where a stiffness is.
    """

    def one(number: int) -> np.ndarray:
        part, reference, mode = problems[number]
        usable = np.isfinite(values[number]).all(axis=1)
        found = np.full(len(usable), np.nan)
        if usable.any():
            eigenvalues, shapes = np.linalg.eigh(part.stiffness_matrices(values[number][usable]))
            alike = reference.only(mode).alike(eigenvalues, shapes, part.output_map)
            found[usable] = alike[..., 0].max(axis=1)
        return found

    return np.stack(shared_out(one, range(len(problems)), threads))
