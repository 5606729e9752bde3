"""Fits from many starts: which minima there are, how often each is found, and the best of them."""

import dataclasses
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import ArrayLike, Float

from fitting.constraints import AbstractConstraint, all_constraints, check_constraints
from fitting.fit import check_residual, chosen_solver, result_of
from fitting.fits_from_starts import FitsFromStarts
from fitting.lanes import WIDTH, Ended
from fitting.objective import Objective
from fitting.residuals.residual import AbstractResidual
from fitting.result import FitResult
from fitting.solve import Solver
from fitting.solvers.stop import CONVERGED
from fitting.starts import sample_starts
from twin._checks import InputError, require_x64
from twin.parameters import ParameterSpace

if TYPE_CHECKING:
    import pandas as pd

KEEP = ("best", "all", "consistent")


@dataclasses.dataclass(frozen=True, repr=False)
class MultistartResult:
    """Where the fits from many starts ended. Shows itself as a table of the minima found in a notebook."""

    space: ParameterSpace
    """The free parameters."""
    starts: np.ndarray
    """Starts in SI (starts, parameters)."""
    values: np.ndarray
    """Ends in SI (starts, parameters); NaN for failed starts."""
    costs: np.ndarray
    """Half the sum of squared residuals at the ends (starts,); NaN for failed starts."""
    stops: np.ndarray
    """Name of each reason for stopping (starts,)."""
    steps: np.ndarray
    """Steps taken (starts,)."""
    clusters: np.ndarray
    """Number of the minimum that each start ended in, the best being 0; -1 for starts that did not converge."""
    results: dict[int, FitResult]
    """Full results of the starts that were kept, by number of the start."""

    @property
    def success(self) -> np.ndarray:
        """Which starts converged (starts,)."""
        return np.isin(self.stops, CONVERGED)

    @property
    def best_start(self) -> int:
        """Number of the start that ended lowest; converged ones before others.

        Raises:
            InputError: if all starts failed.
        """
        finite = np.isfinite(self.costs)
        if not finite.any():
            raise InputError(f"All {len(self.costs)} starts failed. {self.message}")
        among = finite & self.success if (finite & self.success).any() else finite
        return int(np.argmin(np.where(among, self.costs, np.inf)))

    @property
    def best(self) -> FitResult:
        """The lowest fit that converged.

        Raises:
            InputError: if all starts failed.
        """
        return self.results[self.best_start]

    @property
    def message(self) -> str:
        """What happened, and what to do about it."""
        total, good = len(self.costs), int(self.success.sum())
        parts = [f"{good} of {total} starts converged."]
        for stop, count in Counter(self.stops[~self.success]).most_common():
            parts.append(f"{count}: {stop.replace('_', ' ')}.")
        if good:
            found, minima = int(np.sum(self.clusters == 0)), int(self.clusters.max()) + 1
            parts.append(f"{found} of them found the best of {minima} {'minima' if minima > 1 else 'minimum'}.")
            equal = len({int(c) for c in self.clusters[self._as_good()]})
            if equal > 1:
                parts.append(f"{equal} minima fit equally well: these data cannot tell them apart.")
            if found < 3 and total > 10:
                parts.append("The best minimum was hardly found again; draw more starts, or narrow the bounds.")
        elif np.all(self.stops == "not_finite"):
            parts.append("No start could be evaluated. Simulate one of them and look at its status.")
        return " ".join(parts)

    def _as_good(self) -> np.ndarray:
        """Which starts ended as low as the best, to rounding."""
        lowest = np.min(self.costs, where=self.success, initial=np.inf)
        return self.success & (self.costs <= lowest * (1 + 1e-9))

    def minima(self) -> "pd.DataFrame":
        """Table of the distinct minima, the best first: cost, how many starts found it, its parameters in SI."""
        import pandas as pd

        rows = []
        for cluster in range(self.clusters.max(initial=-1) + 1):
            members = np.flatnonzero(self.clusters == cluster)
            lowest = members[np.argmin(self.costs[members])]
            rows.append([self.costs[lowest], members.size, int(lowest), *self.values[lowest]])
        names = [p.label for p in self.space.parameters]
        return pd.DataFrame(rows, columns=["cost", "starts", "lowest start", *names])

    def to_dataframe(self) -> "pd.DataFrame":
        """Table of all starts: status, cost, steps, minimum, parameters at the end in SI."""
        import pandas as pd

        table = {"stop": self.stops, "cost": self.costs, "steps": self.steps, "minimum": self.clusters}
        ends = {path: self.values[:, i] for i, path in enumerate(self.space.paths)}
        return pd.DataFrame({**table, **ends}, index=pd.RangeIndex(len(self.costs), name="start"))

    def _repr_html_(self) -> str:
        table = self.minima().to_html(float_format=lambda x: f"{x:.6g}")
        return f"<div><p><b>Multi-start</b>: {self.message}</p>{table}</div>"

    def __repr__(self) -> str:
        return f"{self.minima().to_string(float_format=lambda x: f'{x:.6g}')}\n{self.message}"


def multistart(
    residual: AbstractResidual,
    model: Any,
    space: ParameterSpace,
    *,
    starts: int | np.integer | Float[ArrayLike, "starts parameters"] = 100,
    sampler: str = "sobol",
    seed: int = 1,
    constraints: Sequence[AbstractConstraint] = (),
    solver: Solver | None = None,
    max_steps: int = 100,
    keep: str = "best",
    correlated: int | None = None,
    variance: str = "estimated",
    width: int = WIDTH,
    threads: int | None = None,
    store: str | Path | None = None,
    executor: Executor | None = None,
    progress: bool = True,
) -> MultistartResult:
    """Fit from many starts as one batch. A start that fails is marked and counted, never fatal.

    The fits run in lanes of one compiled program; a lane that is done takes the next start, so that slow starts hold
    nobody up. Ends are the same to the last bit whatever the other starts are.

    Args:
        residual: as in `fit`.
        model: what is not free stays as it is here.
        space: free parameters.
        starts: number of starts drawn between the bounds on the scale of each parameter, or the starts themselves in SI
            (starts, parameters); rows that are not finite or outside the bounds are marked as failed.
        sampler: "sobol" or "latin_hypercube".
        seed: of the sampler.
        constraints: as in `fit`.
        solver: as in `fit`.
        max_steps: steps after which a start is given up.
        keep: whose full results to keep: "best", "all", or "consistent" (those whose cost is not significantly above
            the best: by less than a χ² of as many degrees of freedom as parameters allows at 95 %).
        correlated: as in `fit`.
        variance: as in `fit`.
        width: fits that run in step.
        threads: sets of lanes that run side by side. By default the number of cores, and one where the residual calls
            LAPACK: two programs that do can wait for each other for ever.
        store: folder that keeps the ends, 128 starts at a time, so that a long run that was killed goes on.
        executor: where the fits run, see `twin.batch.batched`; None for this process.
        progress: show a bar.

    Returns:
        All ends, the minima, and the results kept.

    Raises:
        InputError: unknown path, starts of the wrong shape, bounds that are not finite where starts are to be drawn,
            fewer data than parameters, unknown sampler or `keep`.
    """
    require_x64()
    if keep not in KEEP:
        raise InputError(f"keep must be one of {', '.join(KEEP)}, but is {keep!r}.")
    constraints = all_constraints(constraints)
    solver = chosen_solver(solver, constraints)
    if width < 1:
        raise InputError(f"width must be at least 1, but is {width}.")
    if isinstance(starts, int | np.integer):
        vectors = sample_starts(space, int(starts), sampler=sampler, seed=seed)
    else:
        vectors = _given(np.asarray(starts, dtype=float), space)
    outside = ~np.all((vectors >= np.asarray(space.lower)) & (vectors <= np.asarray(space.upper)), axis=1)
    rows = check_residual(residual, model, space)
    check_constraints(constraints, model)

    def limit(best: float) -> float:
        """Cost up to which a fit is kept."""
        if keep != "consistent":
            return np.inf if keep == "all" else best
        from scipy import special

        reach = float(special.chdtri(len(space), 0.05))
        return best + 0.5 * reach if variance == "known" else best * (1 + reach / max(rows - len(space), 1))

    fits = FitsFromStarts(
        Objective(residual, model, space, constraints),
        solver,
        max_steps,
        width,
        threads,
        keep=lambda cost, best: cost <= limit(best),
    )
    possible = np.where(outside[:, None], np.nan, vectors)
    ended = fits.run(possible, store=store, executor=executor, progress=progress)
    # Without a converged fit the lowest of the others is the best there is to look at.
    counted = ended.success if ended.success.any() else np.isfinite(ended.cost)
    highest = limit(float(np.min(ended.cost, where=counted, initial=np.inf)))
    chosen = [i for i in np.flatnonzero(np.isfinite(ended.cost)).tolist() if keep == "all" or counted[i]]
    solved = fits.outcomes(possible, [i for i in chosen if ended.cost[i] <= highest])
    results = {i: result_of(one, model, space, correlated=correlated, variance=variance) for i, one in solved.items()}
    return MultistartResult(
        space=space,
        starts=space.unscaled_rows(vectors),
        values=space.unscaled_rows(ended.vector),
        costs=ended.cost,
        stops=ended.stop,
        steps=ended.steps,
        clusters=_clusters(ended),
        results=results,
    )


def _given(values: np.ndarray, space: ParameterSpace) -> np.ndarray:
    if values.ndim != 2 or values.shape[1] != len(space) or len(values) == 0:
        raise InputError(
            f"starts has shape {values.shape}; give a number of starts, or an array of one row per start and "
            f"{len(space)} columns ({', '.join(space.paths)})."
        )
    return space.scaled_rows(values)


def _clusters(ended: Ended, *, closeness: float = 1e-3) -> np.ndarray:
    """Numbers of the minima, the lowest first: ends are one minimum if cost and every scaled parameter nearly agree."""
    clusters = np.full(len(ended.cost), -1)
    heads: list[int] = []
    order = np.argsort(ended.cost, kind="stable")
    for i in order[ended.success[order]]:
        for number, head in enumerate(heads):
            near = np.abs(ended.vector[i] - ended.vector[head]) <= closeness * np.maximum(1, np.abs(ended.vector[head]))
            if np.all(near) and ended.cost[i] - ended.cost[head] <= closeness * ended.cost[head] + 1e-30:
                clusters[i] = number
                break
        else:
            clusters[i] = len(heads)
            heads.append(int(i))
    return clusters
