"""Output error: parameters that make a closed-loop simulation follow the record, by gradients through it."""

import dataclasses
from collections.abc import Iterable, Mapping
from typing import Any

import equinox as eqx
from jaxtyping import Array, ArrayLike

from fitting.fit import fit
from fitting.residuals.trajectory import TrajectoryResidual
from fitting.result import FitResult
from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt
from twin.control import SampledLoop
from twin.parameters import ParameterSpace
from twin.plant import AbstractPlant
from twin.record import Record
from twin.references import AbstractReference
from twin.simulation import check_ticks, simulate
from twin.stepping import AbstractStepping
from twin.trajectory import SimulationStatus

# Weighted residuals have a root mean square near 1 where model and deviations are right.
_MISFIT = 5.0


def output_error(
    record: Record,
    system: AbstractPlant | SampledLoop,
    reference: AbstractReference,
    space: ParameterSpace,
    *,
    deviation: Mapping[str, ArrayLike],
    stepping: AbstractStepping | None = None,
    solver: BoundedLevenbergMarquardt | None = None,
    max_steps: int = 100,
    hold: Iterable[str] = (),
    correlated: bool = False,
) -> FitResult:
    """Fit a simulated system to a record.

    Only the reference drives the simulation; what was measured is compared, not fed in. Noise on the record therefore
    does not bias the estimates, which it does in inverse dynamics. The system must start where the record starts: set
    its initial position and velocity from the record, or free them.

    Args:
        record: measured channels, named as outputs of the system.
        system: start of the fit: a plant, or a loop with its controller.
        reference: what drove the system.
        space: free parameters.
        deviation: standard deviation of the noise per channel to compare, in the channel's unit.
        stepping: how time is stepped; as in `simulate`.
        solver: settings of the solver.
        max_steps: steps after which the fit is given up.
        hold: paths of the space to hold at their start this time.
        correlated: whether what is left after the fit is a model error that hangs together over time, rather than
            white noise of the sensors; the standard errors then allow for it.

    Returns:
        The fit, its model being the system with the estimates.

    Raises:
        InputError: as `fit`, or for a channel that does not exist.
    """
    if isinstance(system, SampledLoop):
        check_ticks(record.times, system.period)
    residual = TrajectoryResidual.create(record, reference, deviation, stepping=stepping)
    result = fit(
        residual,
        system,
        space,
        solver=solver,
        max_steps=max_steps,
        hold=hold,
        correlated=len(deviation) if correlated else None,
    )
    warnings = []
    if result.rms > _MISFIT:
        warnings.append(
            f"What is left over is {result.rms:.3g} times the deviations given: a wrong unit, period or initial state, "
            "deviations that are too small, or a model that lacks something. Plot the residual."
        )
    status = _final_status(result.model, reference, record.times, stepping)
    if status != SimulationStatus.successful:
        warnings.append(f"The fitted model's simulation: {SimulationStatus[status]}")
    return dataclasses.replace(result, warning=" ".join(warnings))


@eqx.filter_jit
def _final_status(model: Any, reference: AbstractReference, times: Array, stepping: AbstractStepping | None) -> Any:
    return simulate(model, reference, times, stepping=stepping).status
