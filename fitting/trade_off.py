"""What error, energy and time of a positioning cost each other."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import equinox as eqx
import numpy as np
from jaxtyping import ArrayLike, Float

from fitting.constraints import AbstractConstraint, Inequality
from fitting.cycle_constraints import MEASURES, MeasureLimit
from fitting.cycle_run import CycleRun
from fitting.gain_objective import GainObjective
from fitting.optimal_design import design
from fitting.solvers.slsqp import SLSQP
from twin._checks import InputError, finite, positive
from twin.parameters import ParameterSpace
from twin.performance import PositioningCycle, PositioningPerformance

if TYPE_CHECKING:
    import pandas as pd

_COLUMNS = tuple(f"{name} [{unit}]" for name, unit in MEASURES.items())


def trade_off(
    cycle: PositioningCycle,
    objective: GainObjective,
    space: ParameterSpace,
    *,
    limits: Mapping[str, Float[ArrayLike, "points"] | Sequence[float]] | None = None,
    weights: Sequence[Sequence[float]] | None = None,
    constraints: Sequence[AbstractConstraint] = (),
    max_steps: int = 60,
    solver: SLSQP | None = None,
) -> "pd.DataFrame":
    """Best designs along a curve of compromises, each started from the one before.

    With `limits` one measure is held below each of several values while the objective is minimised (ε-constraint): this
    finds the parts of a curve that is not convex too. With `weights` the objective's weights are varied.

    Args:
        cycle: the cycle, where the first design starts.
        objective: eq. 22 with references.
        space: the free parameters.
        limits: largest values of one of "error" [m], "energy" [J] or "time" [s], in the order of computation: begin
            where the start is feasible.
        weights: weights of error, energy and time, one row per point.
        constraints: further conditions.
        max_steps: evaluations of each design.
        solver: as in `design`.

    Returns:
        A table with one row per point: the limit or weights, the parameters with their units, error, energy, time, the
        objective's cost with its own weights, the number of evaluations, how the design ended, and whether another row
        is better in all three measures ("dominated").

    Raises:
        InputError: neither or both of limits and weights, a limit on several or unknown measures, as `design`.
    """
    import pandas as pd

    points = _points(objective, limits, weights)
    rows = []
    here = cycle
    for labels, weighed, limit in points:
        every = (*constraints, *limit)
        result = design(
            here, weighed, space, constraints=every, experiment=CycleRun.of, max_steps=max_steps, solver=solver
        )
        measures = _measures(result.model, objective)
        named = zip(space.parameters, result.values, strict=True)
        rows.append(
            labels
            | {parameter.label: value for parameter, value in named}
            | dict(zip(_COLUMNS, map(float, measures), strict=True))
            | {"cost": float(objective.cost(measures)), "evaluations": result.evaluations, "status": result.stop}
        )
        # From a point that failed, the next one would hardly succeed.
        here = result.model if result.success else here
    table = pd.DataFrame(rows)
    table["dominated"] = _dominated(np.abs(table[list(_COLUMNS)].to_numpy()))
    return table


def _points(objective: GainObjective, limits: Any, weights: Any) -> list[tuple[dict, GainObjective, tuple]]:
    """Labels, objective and additional constraints of every point."""
    if (limits is None) == (weights is None):
        raise InputError("Give either limits of one measure or weights of the three.")
    if weights is not None:
        rows = np.asarray(weights, dtype=float)
        if rows.ndim != 2 or rows.shape[1] != 3 or not len(rows):
            raise InputError(f"weights must be rows of error, energy and time, but have the shape {rows.shape}.")
        finite("weights", rows)
        labels = ("weight of error", "weight of energy", "weight of time")
        return [(dict(zip(labels, row, strict=True)), objective.reweighed(*row), ()) for row in rows]
    if len(limits) != 1 or next(iter(limits)) not in MEASURES:
        raise InputError(f"limits must name one of {', '.join(MEASURES)}, but names {', '.join(limits) or 'none'}.")
    ((name, values),) = limits.items()
    bounds = np.atleast_1d(np.asarray(values, dtype=float))
    positive(f"limits of the {name}", bounds, MEASURES[name])
    label = f"limit of {name} [{MEASURES[name]}]"
    return [({label: b}, objective, (Inequality(MeasureLimit(name, b, objective.share)),)) for b in bounds]


def _dominated(measures: np.ndarray) -> np.ndarray:
    """Which rows another one is nowhere worse than and somewhere better."""
    no_worse = np.all(measures[None] <= measures[:, None], axis=2)
    better = np.any(measures[None] < measures[:, None] * (1 - 1e-9), axis=2)
    return np.any(no_worse & better, axis=1)


@eqx.filter_jit
def _measures(cycle: PositioningCycle, objective: GainObjective) -> PositioningPerformance:
    return objective.measures(cycle)
