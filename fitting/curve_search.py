"""The smallest value of a composed cost along one variable, from few values and slopes of what it is composed of."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

# Points per interval among which the smallest cost of the interpolated measures is looked for.
_POINTS = 64
_GOLDEN = 0.5 * (np.sqrt(5.0) - 1)


class CurveSearch(NamedTuple):
    """What a search along one variable found."""

    best: float
    """Variable with the smallest cost that was evaluated."""
    cost: float
    """Cost there."""
    tried: np.ndarray
    """Variables in the order of their evaluation (evaluations,)."""
    costs: np.ndarray
    """Costs in that order, NaN where the evaluation failed (evaluations,)."""
    stop: str
    """"converged", "too_many_steps", or "not_finite" if no evaluation succeeded."""


def search_curve(
    measure: Callable[[float], tuple[np.ndarray, np.ndarray]],
    cost: Callable[[np.ndarray], np.ndarray],
    lower: float,
    upper: float,
    *,
    nodes: int = 5,
    most: int = 20,
    tolerance: float = 1e-6,
) -> CurveSearch:
    """Smallest cost(measures(x)) within bounds, where the measures are smooth but their cost may have kinks.

    The measures are interpolated by cubics through all values and slopes found so far; the cost of the interpolated
    measures, kinks and all, is minimised over the whole range, and the measures are evaluated there, until nothing more
    is promised. A kink, as that of |err| where err passes through zero, is met as fast as a root is; basins that begin
    and end between two neighbouring nodes can be missed. Where an evaluation fails next to the best point, the gap is
    halved once more before the search ends.

    Args:
        measure: from the variable to measures and their slopes (measures,), NaN where it fails.
        cost: from measures (measures, points) to costs (points,).
        lower: lower bound.
        upper: upper bound.
        nodes: evenly spread points to begin with, at least two.
        most: evaluations, those of the nodes included.
        tolerance: cost that a further evaluation has to promise.

    Returns:
        The best point evaluated, with all that were tried.
    """
    tried: list[float] = []
    values: list[np.ndarray] = []
    slopes: list[np.ndarray] = []

    def evaluate(x: float) -> None:
        value, slope = measure(x)
        tried.append(float(x))
        values.append(np.asarray(value, dtype=float))
        slopes.append(np.asarray(slope, dtype=float))

    for x in np.linspace(lower, upper, nodes):
        evaluate(x)
    stop = "too_many_steps"
    while True:
        x = np.asarray(tried)
        y, dy = np.stack(values, axis=1), np.stack(slopes, axis=1)
        known = np.all(np.isfinite(y) & np.isfinite(dy), axis=0)
        costs = np.where(known, cost(np.where(known, y, 1.0)), np.nan)
        if not known.any():
            stop = "not_finite"
            break
        order = np.argsort(x)
        promise, there = _promised(x[order], y[:, order], dy[:, order], known[order], cost)
        best = np.nanmin(costs)
        near = np.min(np.abs(x - there)) <= 1e-10 * (upper - lower)
        if near or best - promise <= tolerance:
            there = _beside_failure(x[order], costs[order], 0.01 * (upper - lower))
            if there is None:
                stop = "converged"
                break
        if len(tried) >= most:
            break
        evaluate(there)
    if not known.any():
        return CurveSearch(float("nan"), float("nan"), x, costs, stop)
    i = int(np.nanargmin(costs))
    return CurveSearch(float(x[i]), float(costs[i]), x, costs, stop)


def _promised(
    x: np.ndarray, y: np.ndarray, slope: np.ndarray, known: np.ndarray, cost: Callable[[np.ndarray], np.ndarray]
) -> tuple[float, float]:
    """Smallest cost of the interpolated measures between neighbours that are both known, and where."""
    from scipy.interpolate import CubicHermiteSpline  # a second to import

    least, place = np.inf, float(x[known][0])
    for i in np.flatnonzero(known[:-1] & known[1:]):
        curve = CubicHermiteSpline(x[i : i + 2], y[:, i : i + 2], slope[:, i : i + 2], axis=1)
        grid = np.linspace(x[i], x[i + 1], _POINTS)
        k = int(np.argmin(cost(curve(grid))))
        low, high = grid[max(k - 1, 0)], grid[min(k + 1, _POINTS - 1)]
        while high - low > 1e-12 * (x[-1] - x[0]):
            left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
            one, other = cost(curve(np.asarray([left, right])))
            low, high = (low, right) if one < other else (left, high)
        # The end of the grid that the halving only comes close to is a candidate of its own.
        candidates = np.asarray([0.5 * (low + high), grid[k]])
        found = cost(curve(candidates))
        j = int(np.argmin(found))
        if found[j] < least:
            least, place = float(found[j]), float(candidates[j])
    return least, place


def _beside_failure(x: np.ndarray, costs: np.ndarray, width: float) -> float | None:
    """The middle of a gap wider than this between the best point and a failed neighbour; None if there is none."""
    i = int(np.nanargmin(costs))
    for k in (i - 1, i + 1):
        if 0 <= k < x.size and np.isnan(costs[k]) and abs(x[k] - x[i]) > width:
            return float(0.5 * (x[k] + x[i]))
    return None
