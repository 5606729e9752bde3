"""The whole of Leipe et al. on a simulated bench: sweeps, the published chain, direct fits, validation, outlook."""

import dataclasses
from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.fit import fit
from fitting.identification.leipe_bench import (
    PERIOD,
    RATED_TORQUE,
    RESISTANCE,
    STEPPING,
    TORQUE_CONSTANT,
    Measurement,
    bench_drive,
    bench_gains,
    bench_loop,
    measure,
    measure_against_stop,
    sweep_reference,
)
from fitting.identification.leipe_curves import CurveFits as CurveFits
from fitting.identification.leipe_curves import fit_printed_curves as fit_printed_curves
from fitting.identification.preload_chain import PreloadChain, identify_preload_chain
from fitting.identification.preload_direct import (
    DirectFits,
    cut,
    fit_direct,
    motion_space,
    response_evidence,
    with_laws,
    with_zeros,
)
from fitting.identification.preload_sweep import PreloadSweep
from fitting.identification.static_stiffness import identify_static_stiffness
from fitting.residuals.driven_table import DrivenTableResidual
from fitting.residuals.trajectory import TrajectoryResidual
from fitting.result import FitResult
from twin.control import SampledLoop
from twin.drives import DrivenTable, RackPinionDrive, leipe_drive
from twin.drives.preload_choice import PreloadChoice, preload_for_stiffness
from twin.parameters import Parameter, ParameterSpace
from twin.references import AbstractReference, JerkLimitedMove
from twin.simulation import simulate
from twin.trajectory import Trajectory

PRELOADS = (0.0, 3.0, 6.0, 8.0, 12.0, 20.0, 30.0, 50.0, 75.0, 100.0)
"""Preloads of the sweeps [%]."""
LEFT_OUT_UP_TO = 6.0
"""Preloads up to this one are not fitted, because of backlash (section III) [%]."""
BAND = (30.0, 200.0)
"""Frequencies that the fits use [Hz]."""
SWEEP_START, SWEEP_DURATION = 1.0, 40.0
"""Start and duration of a sweep [s]."""
_MOTION_PRELOADS = (8.0, 20.0, 50.0, 100.0)
# While the sweep passes from 60 to 120 Hz, about the resonance.
_MOTION_PART = (SWEEP_START + 6.0, SWEEP_START + 12.0)
_MOVE_TIME = 3.2
_MOVE_START = 0.5


@dataclasses.dataclass(frozen=True)
class SweepStudy:
    """Sweeps at all preloads, and what the published chain makes of them."""

    measurements: tuple[Measurement, ...]
    """What the bench recorded."""
    sweeps: tuple[PreloadSweep, ...]
    """The records as sweeps."""
    paper: PreloadChain
    """Peaks read as printed."""
    exact: PreloadChain
    """Peaks read by inverting the true curve."""
    true_totals: np.ndarray
    """True total stiffness and damping at the true mean forces (preloads, 2) [N/m, Ns/m]."""


def study_sweeps(preloads: Sequence[float] = PRELOADS, *, seed: int = 1) -> SweepStudy:
    """Sweep the bench at several preloads and identify it by the published chain, with both estimators.

    Args:
        preloads: in per cent of the rated torque.
        seed: of the noise.

    Raises:
        InputError: a preload beyond the rated torque, too few above `LEFT_OUT_UP_TO`.
    """
    reference = sweep_reference(SWEEP_DURATION, SWEEP_START)
    measurements = measure(preloads, reference, SWEEP_START + SWEEP_DURATION, seed=seed)
    sweeps = [PreloadSweep(p, m.record, SWEEP_START) for p, m in zip(preloads, measurements, strict=True)]
    responses = [sweep.response(band=BAND) for sweep in sweeps]
    drive = leipe_drive()
    chains = [
        identify_preload_chain(
            sweeps, drive, estimator=name, band=BAND, leave_out_up_to=LEFT_OUT_UP_TO, responses=responses
        )
        for name in ("paper", "exact")
    ]
    mesh = bench_drive().train_1.mesh
    first = round(SWEEP_START / PERIOD)
    forces = np.stack([np.mean(np.asarray(m.forces)[:, first:], axis=1) for m in measurements])
    totals = np.stack([np.sum(np.asarray(law(jnp.asarray(forces))), axis=1) for law in (mesh.stiffness, mesh.damping)])
    return SweepStudy(tuple(measurements), tuple(sweeps), chains[0], chains[1], totals.T)


@dataclasses.dataclass(frozen=True)
class DirectStudy:
    """All parameters at once."""

    fits: DirectFits
    """From responses, motions, and both."""
    static: FitResult
    """From a slow ramp against a stop."""
    moves: tuple[Measurement, ...]
    """Records of a move, at `move_preloads`."""
    move: JerkLimitedMove
    """The move."""
    move_preloads: tuple[float, ...]
    """Preloads of the records [%]; at the lowest one flank after the other lets go."""


def study_direct(found: SweepStudy, *, seed: int = 2) -> DirectStudy:
    """Fit all laws at once, starting from what the chain found.

    Args:
        found: sweeps and chain.
        seed: of the noise of the further records.
    """
    move = JerkLimitedMove(0.6, 0.4, 1.6, 40.0, start_time=_MOVE_START)
    preloads = (6.0, 20.0)
    moves = measure(preloads, move, _MOVE_TIME, seed=seed)
    drive = with_laws(leipe_drive(play=20e-6), found.exact.stiffness.law, found.exact.damping.law)
    points = [(s, p.response) for s, p in zip(found.sweeps, found.exact.points, strict=True) if p.used]
    start = with_zeros(DrivenTable(drive), points[-1][0])
    responses = response_evidence([s for s, _ in points], [r for _, r in points], drive)
    chosen = [s for s in found.sweeps if s.preload_percent in _MOTION_PRELOADS]
    r = float(drive.travel_per_radian)
    swept = DrivenTableResidual.create(
        [cut(s.record, *_MOTION_PART) for s in chosen], r, position_deviation=1e-7, force_deviation=5.0
    )
    moved = DrivenTableResidual.create(
        [cut(m.record, _MOVE_START - 0.05, _MOVE_START + float(move.duration()) + 0.3) for m in moves],
        r,
        position_deviation=3e-6,
        force_deviation=20.0,
    )
    fits = fit_direct(responses, {"sweeps": swept, "moves": moved}, start, motion_space(play=True))
    static = identify_static_stiffness(measure_against_stop(10.0, 6.0, seed=seed), drive, least_torque=0.5)
    return DirectStudy(fits, static, tuple(moves), move, preloads)


@dataclasses.dataclass(frozen=True)
class Validation:
    """A move that no fit has seen."""

    motors: FitResult
    """Inertia and friction of the motors, from the torques of another move."""
    drive: RackPinionDrive
    """The identified drive."""
    reference: JerkLimitedMove
    """1 m, 0.5 m/s, 1 m/s², 20 m/s³ (section V-C)."""
    measurement: Measurement
    """What the bench did, at 10 % preload."""
    simulated: Trajectory
    """What the identified drive does."""
    mean_absolute_errors: tuple[float, float]
    """J_τ of both motors over the whole record [Nm]."""
    errors_while_moving: tuple[float, float]
    """The same from the start to the end of the move, without standstill [Nm]."""


def validate(direct: DirectStudy, *, seed: int = 3) -> Validation:
    """Identify what only torques see, and compare the torques of the published validation move.

    Args:
        direct: the direct fits, whose joint model is used.
        seed: of the noise of the validation record.
    """
    last = len(direct.moves) - 1
    evidence = TrajectoryResidual.create(
        direct.moves[last].record, direct.move, {"torque_1": 0.05, "torque_2": 0.05}, stepping=STEPPING
    )
    start = twin_loop(direct.fits.joint.model.drive, direct.move_preloads[last])
    space = motor_space()
    # A round inertia, hardly any friction.
    start = space.with_values(start, jnp.asarray([5e-3, 0.05, 1e-3]))
    motors = fit(evidence, start, space)
    drive = motors.model.plant.plant
    reference = JerkLimitedMove(1.0, 0.5, 1.0, 20.0, start_time=_MOVE_START)
    (measurement,) = measure([10.0], reference, _MOVE_TIME, seed=seed)
    simulated = follow(twin_loop(drive, 10.0), reference, measurement.record.times)
    times = np.asarray(measurement.record.times) - _MOVE_START
    moving = (times >= 0) & (times <= float(reference.duration()))
    errors = np.asarray(
        [np.abs(simulated.channel(name) - measurement.record.channel(name)) for name in ("torque_1", "torque_2")]
    )
    whole, part = errors.mean(axis=1).tolist(), errors[:, moving].mean(axis=1).tolist()
    return Validation(motors, drive, reference, measurement, simulated, tuple(whole), tuple(part))


def twin_loop(drive: RackPinionDrive, preload_percent: float) -> SampledLoop:
    """A drive under the bench's controllers, whose delay the twin does not know.

    Args:
        drive: the drive.
        preload_percent: preload in per cent of the rated torque.
    """
    return bench_loop(drive, bench_gains(preload_percent), delayed=False)


@eqx.filter_jit
def follow(loop: SampledLoop, reference: AbstractReference, times: Array) -> Trajectory:
    """Simulate a loop at its ticks, compiled.

    Args:
        loop: the loop.
        reference: the motion wanted.
        times: ticks [s].
    """
    return simulate(loop, reference, times, stepping=STEPPING)


def motor_space() -> ParameterSpace:
    """Inertia and friction of the motors of a loop, the same for both."""
    one, two = "plant.plant.train_1.", "plant.plant.train_2."
    return ParameterSpace(
        [
            Parameter(one + "inertia", "kg m^2", lower=0.0, scale="log", tied=(two + "inertia",)),
            Parameter(one + "friction.coulomb", "N m", lower=0.0, tied=(two + "friction.coulomb",)),
            Parameter(one + "friction.viscous", "N m s/rad", lower=0.0, size=1e-3, tied=(two + "friction.viscous",)),
        ]
    )


def choose_preloads(
    drive: RackPinionDrive, stiffness: float, loads: Sequence[float], *, velocity: float = 0.01
) -> list[PreloadChoice]:
    """The preload that keeps a stiffness under each of some process forces, with its copper loss (section VI).

    Args:
        drive: the drive.
        stiffness: total stiffness wanted [N/m].
        loads: process forces [N].
        velocity: velocity of the table [m/s].

    Raises:
        InputError: a stiffness that cannot be reached.
    """
    return [
        preload_for_stiffness(
            drive,
            stiffness,
            rated_torque=RATED_TORQUE,
            torque_constant=TORQUE_CONSTANT,
            resistance=RESISTANCE,
            load=load,
            velocity=velocity,
        )
        for load in loads
    ]
