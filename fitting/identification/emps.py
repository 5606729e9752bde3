"""The EMPS study: inverse dynamics as published, then output error, its model chosen by the training record alone."""

import dataclasses
import time
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.identification.emps_model import (
    CYCLE,
    PERIOD,
    SCREW_LEAD,
    STEPPING,
    Rung,
    emps_channels,
    emps_ladder,
    emps_reference,
    emps_space,
    emps_start,
    on_record,
    with_screw_phase,
)
from fitting.identification.inverse_dynamics import DerivativeFilter, inverse_dynamics
from fitting.identification.output_error import output_error
from fitting.residuals.trajectory import relative_error_percent
from fitting.result import FitResult
from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt
from fitting.uncertainty import correlation_time
from twin.control import SampledLoop
from twin.drives import ServoAxis
from twin.io.emps import EmpsRecord, read_emps
from twin.laws import AsymmetricFriction, CoulombViscousFriction
from twin.parameters import Parameter, ParameterSpace
from twin.simulation import simulate

SYMMETRIC = ("mass", "friction.viscous", "friction.coulomb", "offset")
"""Parameters of the published symmetric model."""
ASYMMETRIC = (
    "mass",
    "friction.viscous_positive",
    "friction.viscous_negative",
    "friction.coulomb_positive",
    "friction.coulomb_negative",
)
"""Parameters of the published asymmetric model."""
# Before the first test pulse (tick 344), after the start of the record has settled.
_QUIET = slice(20, 340)


class Score(NamedTuple):
    """Relative errors of a closed-loop simulation."""

    force_percent: float
    """Of the force g·u, unfiltered [%]."""
    velocity_percent: float
    """Of the velocity from the filtered position [%]."""
    acceleration_percent: float
    """Of the acceleration from the filtered position [%]."""


@dataclasses.dataclass(frozen=True)
class Tried:
    """One model of the ladder, fitted on cycles 1 to 3."""

    rung: Rung
    """The model."""
    fit: FitResult
    """Its fit."""
    fitted_square: float
    """Mean squared weighted residual on cycles 1 to 3."""
    held_back_square: float
    """The same on cycle 4, which the fit did not see."""


@dataclasses.dataclass(frozen=True)
class EmpsStudy:
    """Everything that the EMPS study finds."""

    train: EmpsRecord
    """Training record."""
    test: EmpsRecord
    """Test record, with pulses."""
    inverse: dict[str, FitResult]
    """Inverse dynamics, "symmetric" and "asymmetric"."""
    ladder: tuple[Tried, ...]
    """Models tried."""
    chosen: int
    """Index of the model chosen, by its error on cycle 4."""
    fit: FitResult
    """The chosen model fitted on the whole training record."""
    screw_phase: float
    """Encoder zero of the test record relative to the training record, within one screw turn [m]."""
    seconds: dict[str, float]
    """Wall time by part."""


def run_emps_study(train: EmpsRecord | None = None, test: EmpsRecord | None = None) -> EmpsStudy:
    """Identify the EMPS axis from its measured records.

    The model is the one of the ladder that predicts cycle 4 best after a fit on cycles 1 to 3; the test record takes no
    part. From the test record come only its initial state, the gain of its pulses, and the zero of its encoder within
    one screw turn (from the ticks before the first pulse).

    Args:
        train: training record; read from the data set if not given.
        test: test record; likewise.

    Returns:
        The study.

    Raises:
        DataNotFound: if the data set is not at hand.
    """
    clock = _Clock()
    train = read_emps() if train is None else train
    test = read_emps(record="test") if test is None else test
    inverse = {
        "symmetric": inverse_dynamics(
            train.record, ServoAxis(1.0, CoulombViscousFriction(1.0, 1.0, 1e-9)), plain_space(SYMMETRIC)
        ),
        "asymmetric": inverse_dynamics(
            train.record, ServoAxis(1.0, AsymmetricFriction(1.0, 1.0, 1.0, 1.0, 1e-9)), plain_space(ASYMMETRIC)
        ),
    }
    clock.lap("inverse_dynamics")
    ladder = _climb(train)
    chosen = int(np.argmin([tried.held_back_square for tried in ladder]))
    clock.lap("choosing_the_model")
    best = ladder[chosen]
    fit = _fit(train, best.fit.model, best.rung, samples=len(train.record.times), rtol=1e-5, correlated=True)
    clock.lap("final_fit")
    phase = _screw_phase(fit.model, test)
    clock.lap("encoder_zero_of_the_test_record")
    return EmpsStudy(train, test, inverse, ladder, chosen, fit, phase, clock.laps)


def score(model: SampledLoop, data: EmpsRecord) -> Score:
    """Closed-loop simulation of a record, compared with it: all samples, force unfiltered.

    Args:
        model: axis with its controller; its initial state is taken from the record.
        data: record.
    """
    command, position = simulate_record(model, data)
    measured = _motion(np.asarray(data.record.channel("position")))
    simulated = _motion(position)
    return Score(
        relative_error_percent(np.asarray(data.record.channel("voltage")), command),
        relative_error_percent(measured[1], simulated[1]),
        relative_error_percent(measured[2], simulated[2]),
    )


def simulate_record(model: SampledLoop, data: EmpsRecord) -> tuple[np.ndarray, np.ndarray]:
    """Command [V] and position [m] of a closed-loop simulation of a record (samples,).

    Args:
        model: axis with its controller.
        data: record.
    """
    trajectory = _simulate(on_record(model, data), emps_reference(data.record), data.record.times)
    return np.asarray(trajectory.channel("command")), np.asarray(trajectory.channel("position"))


def information_criteria(study: EmpsStudy) -> list[tuple[float, float]]:
    """AIC and BIC of each model tried, on cycles 1 to 3.

    n·ln(mean square) + 2k and + k·ln(n), n being the number of independent residuals: neighbouring samples of a model
    error say the same thing, so the samples are divided by the correlation time of the largest model's residual.

    Args:
        study: the study.
    """
    largest = study.ladder[-1].fit.residual
    count = largest.size / correlation_time(largest.reshape(2, -1))
    pairs = []
    for tried in study.ladder:
        k, fitness = len(tried.rung.free), count * np.log(tried.fitted_square)
        pairs.append((float(fitness + 2 * k), float(fitness + k * np.log(count))))
    return pairs


def _climb(train: EmpsRecord) -> tuple[Tried, ...]:
    model, tried = emps_start(train), []
    for rung in emps_ladder():
        # Enough to compare models: Bates and Watts' own limit. A coarse model creeps for long beyond it.
        fit = _fit(train, model, rung, samples=3 * CYCLE, rtol=1e-3)
        model = fit.model
        command, position = simulate_record(model, train)
        record, deviation = train.record, _deviation(train)
        rows = np.stack(
            [
                (position - np.asarray(record.channel("position"))) / deviation["position"],
                (command - np.asarray(record.channel("voltage"))) / deviation["command"],
            ]
        )
        tried.append(
            Tried(rung, fit, float(np.mean(rows[:, : 3 * CYCLE] ** 2)), float(np.mean(rows[:, 3 * CYCLE :] ** 2)))
        )
    return tuple(tried)


def _fit(
    train: EmpsRecord, start: Any, rung: Rung, *, samples: int, rtol: float, correlated: bool = False
) -> FitResult:
    record = emps_channels(train.record).slice(stop=float(train.record.times[0]) + (samples - 0.5) * PERIOD)
    space = emps_space()
    return output_error(
        record,
        start,
        emps_reference(train.record),
        space,
        deviation=_deviation(train),
        stepping=STEPPING,
        solver=BoundedLevenbergMarquardt(rtol=rtol),
        hold=[path for path in space.paths if path not in rung.free],
        correlated=correlated,
    )


def _deviation(train: EmpsRecord) -> dict[str, float]:
    # What a good rigid model leaves over: half a micrometre, and 2 % of the command. Only their ratio matters.
    voltage = np.asarray(train.record.channel("voltage"))
    return {"position": 5e-7, "command": 0.02 * float(np.sqrt(np.mean(voltage**2)))}


def _screw_phase(model: SampledLoop, test: EmpsRecord) -> float:
    """The shift of the screw's phase that follows the test record best before its first pulse."""
    origins = jnp.arange(0.0, SCREW_LEAD, 2.5e-5)
    times = test.record.times[: _QUIET.stop]
    reference, start = emps_reference(test.record), on_record(model, test)
    measured = test.record.channel("voltage")[: _QUIET.stop]

    def misfit(origin: Any) -> Any:
        command = simulate(with_screw_phase(start, origin), reference, times, stepping=STEPPING).channel("command")
        return jnp.sum((command - measured)[_QUIET] ** 2)

    return float(origins[jnp.argmin(eqx.filter_jit(jax.vmap(misfit))(origins))])


@eqx.filter_jit
def _simulate(model: SampledLoop, reference: Any, times: Any) -> Any:
    return simulate(model, reference, times, stepping=STEPPING)


def _motion(position: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return DerivativeFilter()(position, PERIOD)


def plain_space(paths: tuple[str, ...]) -> ParameterSpace:
    """Parameters of a plain servo axis without bounds, with their units.

    Args:
        paths: dotted paths, such as `SYMMETRIC`.
    """
    units = {"mass": "kg", "viscous": "N s/m", "coulomb": "N", "offset": "N"}
    return ParameterSpace([Parameter(p, next(u for name, u in units.items() if name in p)) for p in paths])


class _Clock:
    """Wall time between laps."""

    def __init__(self):
        self.laps: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        now = time.perf_counter()
        self.laps[name], self._last = round(now - self._last, 2), now


def reproduce_emps(out: Path) -> str:
    """Run the study and write its report; the command `drivetwin reproduce emps`.

    Args:
        out: folder for the results.
    """
    from fitting.identification.emps_report import write_emps_report

    return write_emps_report(run_emps_study(), out)
