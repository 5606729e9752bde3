"""All runs of the small problems of a machine, each checked against all of its modes."""

import dataclasses
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float, Int

from fitting.blas_threads import one_blas_thread
from fitting.identification.machine_affine import AffineMachine
from fitting.identification.machine_evidence import Evidence
from fitting.solvers.stop import CONVERGED
from twin.parameters import ParameterSpace

if TYPE_CHECKING:
    import pandas as pd

# Cost that the run's own mode may be above that of the most alike mode by rounding.
_SAME = 1e-8
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
    """Steps of each run."""

    @property
    def strayed(self) -> Bool[np.ndarray, "problems runs"]:
        """Runs that followed another mode than the one most like the reference mode."""
        return self.macxp > self.followed + _SAME

    @property
    def failed(self) -> Bool[np.ndarray, "problems runs"]:
        """Runs that did not converge, or that strayed: they count for nothing."""
        return ~np.isin(self.stop, CONVERGED) | self.strayed | ~np.isfinite(self.macxp)


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

    with one_blas_thread(), ThreadPoolExecutor(threads or os.cpu_count() or 1) as pool:
        return np.stack(list(pool.map(one, range(len(problems)))))
