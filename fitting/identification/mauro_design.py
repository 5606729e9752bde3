"""Gains of the axis of Mauro et al. found by gradients: the position gain alone, all gains together, and trade-offs."""

import dataclasses
from typing import Any

import numpy as np
import pandas as pd

from fitting.constraints import Inequality
from fitting.cycle_constraints import MeasureLimit, cycle_constraints
from fitting.cycle_run import CycleRun
from fitting.design_result import DesignResult
from fitting.gain_design import POSITION_GAIN, design_gain
from fitting.gain_objective import GainObjective
from fitting.identification.mauro_study import TableStudy
from fitting.identification.mauro_table import OPTIMAL_GAIN, mauro_table
from fitting.optimal_design import design
from fitting.solvers.slsqp import SLSQP
from fitting.trade_off import trade_off
from twin.io.units import to_si
from twin.parameters import Parameter, ParameterSpace

# The designs are made with these steps; the table's rows do not move between them and those of a quarter [s].
_STEP = 2e-4
# Gains together: allowed are a static error of 5 µm, a peak of 2 of the sensitivity, and a thousandth of the travel
# beyond the target.
_ERROR, _SENSITIVITY, _OVERSHOOT = 5e-6, 2.0, 1e-3
_CONTROLLER = "loop.controller"
# A tenth of a per mille of the cost is nothing beside what the model leaves open.
_SOLVER = SLSQP(rtol=1e-4, atol=1e-5)
_EVALUATIONS = 40


@dataclasses.dataclass(frozen=True)
class DesignStudy:
    """Gains found by gradients."""

    sweep_cost: float
    """Least cost of the 20 runs of the twin."""
    alone: DesignResult
    """Position gain alone."""
    together: DesignResult
    """Position gain, gains of the velocity controller and feed-forward together, under constraints."""
    cost_together: float
    """Eq. 22 of that design, on the scale of the twin's sweep."""
    compromises: pd.DataFrame
    """Trade-off between energy and response time."""

    def summary(self) -> dict[str, Any]:
        """The part of `summary.json` on the design."""
        return {
            "cost": self.cost_together,
            "evaluations": self.together.evaluations,
            "gains": {path: self.together[path] for path in self.together.space.paths},
            "constraints": dict(
                zip(self.together.constraint_names, map(float, self.together.constraint_values), strict=True)
            ),
            "message": self.together.message,
            "gain_alone": {
                "cost": self.alone.cost,
                "evaluations": self.alone.evaluations,
                "k_v": 60 * self.alone[POSITION_GAIN],
                "sweep_cost": self.sweep_cost,
                "message": self.alone.message,
            },
        }


def gain_space() -> ParameterSpace:
    """Gains of position and velocity controller, and the feed-forward."""
    return ParameterSpace(
        [
            Parameter(POSITION_GAIN, "1/s", 10.0, 120.0, scale="log"),
            Parameter(f"{_CONTROLLER}.velocity_gain", "Vs/rad", 0.5, 20.0, scale="log"),
            Parameter(f"{_CONTROLLER}.integral_gain", "V/rad", 1e-2, 100.0, scale="log"),
            Parameter(f"{_CONTROLLER}.feedforward", "", 0.0, 1.0),
        ]
    )


def study_design(study: TableStudy) -> DesignStudy:
    """Design the gains of the twin behind Table 1, on the scale of its own sweep.

    Args:
        study: the twin behind Table 1.
    """
    cycle = study.fit.model.cycle(to_si(OPTIMAL_GAIN, "1/min", "1/s"), step=_STEP)
    objective = GainObjective.of_sweep(*study.rows)
    gains = to_si(mauro_table().gain, "1/min", "1/s")
    alone = design_gain(cycle, objective, (float(gains.min()), float(gains.max())))
    # The error as a limit, energy and time as the cost: along |err| = 0 the whole cost has a kink, on which it creeps.
    limits = cycle_constraints(error=_ERROR, overshoot=_OVERSHOOT, sensitivity=_SENSITIVITY)
    economy = objective.reweighed(0.0, 1.0, 1.0)
    # With a limit of the time that does not bind, the program is the one of the trade-off and is compiled once.
    slowest, best = float(np.max(study.rows.time)), float(study.rows.time[np.argmin(study.cost)])
    together = design(
        alone.model,
        economy,
        gain_space(),
        constraints=(*limits, Inequality(MeasureLimit("time", 2 * slowest, objective.share))),
        experiment=CycleRun.of,
        solver=_SOLVER,
        max_steps=_EVALUATIONS,
    )
    # Faster and faster, each design started from the one before.
    compromises = trade_off(
        together.model,
        economy,
        gain_space(),
        limits={"time": best * np.array([1.1, 1.06, 1.03])},
        constraints=limits,
        solver=_SOLVER,
        max_steps=_EVALUATIONS,
    )
    cost = float(objective.sharp_cost(objective.measures(together.model)))
    return DesignStudy(float(np.min(study.cost)), alone, together, cost, compromises)
