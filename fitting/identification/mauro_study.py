"""Table 1 of Mauro et al. repeated by a twin that is fitted to it: section 7, eq. 22, fig. 11."""

from typing import NamedTuple

import equinox as eqx
import numpy as np

from fitting.fit import fit
from fitting.identifiability import IdentifiabilityReport, identifiability
from fitting.identification.mauro_residual import ColumnErrors, TableResidual
from fitting.identification.mauro_table import REPEATED_GAIN, MauroTable, mauro_table
from fitting.identification.mauro_twin import TableTwin, table_space, table_start
from fitting.result import FitResult
from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt
from twin.performance import PositioningPerformance, positioning_cost

# Steps of the fit, and those that its rows are judged with [s].
_COARSE, _FINE = 2e-4, 5e-5
# Friction that catches the axis a little earlier or later makes the cost rough, and the valley that the table leaves
# open is flat: the fit ends where a full step of the linear model promises less than 4 % of the cost.
_SOLVER = BoundedLevenbergMarquardt(rtol=0.2)


class TableStudy(NamedTuple):
    """The twin behind Table 1 and how it was judged."""

    fit: FitResult
    """The fit."""
    seen: IdentifiabilityReport
    """Which values the table determines."""
    rows: PositioningPerformance
    """Error with its sign, energy and time of the 20 rows, one inertia [m, J, s]."""
    cost: np.ndarray
    """Eq. 22 of these rows."""
    six_degrees: PositioningPerformance
    """The same rows with six degrees of freedom."""
    coarse: PositioningPerformance
    """The rows with the steps of the fit, four times as long."""
    half_presliding: PositioningPerformance
    """The same rows with friction that turns around over half the angle."""


class PrintedCost(NamedTuple):
    """Eq. 22 on Table 1's own columns."""

    cost: np.ndarray
    """Cost of the rows."""
    largest_deviation: float
    """From the printed cost."""
    optimum: float
    """Gain of the least cost [1/min]."""


def study_cost() -> PrintedCost:
    """Eq. 22 on Table 1's own columns."""
    table = mauro_table()
    cost = np.asarray(positioning_cost(table.error, table.energy, table.time))
    return PrintedCost(cost, float(np.max(np.abs(cost - table.cost))), float(table.gain[np.argmin(cost)]))


def study_table(start: TableTwin | None = None, *, max_steps: int = 20) -> TableStudy:
    """Fit the twin to Table 1, and run it with finer steps and in other ways.

    Args:
        start: where the fit starts; chosen values if not given.
        max_steps: steps after which the fit is given up.
    """
    space = table_space()
    begin = table_start() if start is None else start
    result = fit(TableResidual.of(step=_COARSE), begin, space, solver=_SOLVER, max_steps=max_steps)
    rows = rows_of(result.model)
    finer = eqx.tree_at(lambda twin: twin.presliding, result.model, result.model.presliding / 2)
    return TableStudy(
        fit=result,
        seen=identifiability(result),
        rows=rows,
        cost=np.asarray(positioning_cost(*rows)),
        six_degrees=rows_of(result.model, rigid=False),
        coarse=rows_of(result.model, step=_COARSE),
        half_presliding=rows_of(finer),
    )


def rows_of(twin: TableTwin, *, rigid: bool = True, step: float = _FINE) -> PositioningPerformance:
    """The 20 rows of Table 1 as a twin has them, in one batch.

    Args:
        twin: the axis.
        rigid: one inertia instead of six degrees of freedom.
        step: length of the integration steps [s].
    """
    return _performance(TableResidual.of(step=step, rigid=rigid), twin)


def column_errors(rows: PositioningPerformance, table: MauroTable | None = None) -> ColumnErrors:
    """Root mean squares over the rows of what the twin deviates from the table, the error by its magnitude.

    Time and energy of the row that repeats another do not count.

    Args:
        rows: as `rows_of` gives them.
        table: Table 1 if not given.
    """
    table = mauro_table() if table is None else table
    counted = table.gain != REPEATED_GAIN
    return ColumnErrors(
        time=_rms((np.asarray(rows.time) / table.time - 1)[counted]),
        energy=_rms((np.asarray(rows.energy) / (1e3 * table.energy) - 1)[counted]),
        error=_rms(np.abs(np.asarray(rows.error)) - 1e-6 * table.error),
    )


@eqx.filter_jit
def _performance(residual: TableResidual, twin: TableTwin) -> PositioningPerformance:
    return residual.performance(twin)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
