"""Load-dependent stiffness and damping at once: from all frequency responses, from motions, and from both."""

import dataclasses
from collections.abc import Mapping, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.fit import fit
from fitting.identification.preload_sweep import PreloadSweep
from fitting.identification.static_stiffness import LEAST_ORDER
from fitting.residuals.driven_table import DrivenTableResidual
from fitting.residuals.preloaded_response import PreloadedResponseResidual
from fitting.residuals.residual import JointResidual
from fitting.residuals.weighted import Weighted
from fitting.result import FitResult
from fitting.uncertainty import correlation_time
from twin._checks import InputError
from twin.drives import DrivenTable, RackPinionDrive
from twin.frf import FRF
from twin.laws import AbstractLoadLaw
from twin.parameters import Parameter, ParameterSpace
from twin.record import Record

# Fits to motions after the first one, each weighted by the scatter about the one before.
_ROUNDS = 2
_FIRST, _SECOND = "drive.train_1.mesh.", "drive.train_2.mesh."


def mesh_space() -> ParameterSpace:
    """k1, k2 and d1, d2, d3 of a `DrivenTable`, the same in both drive trains."""
    names = (
        ("stiffness.k1", "N/m", 0.0),
        ("stiffness.k2", "1", LEAST_ORDER),
        ("damping.d1", "N^2 s/m", 0.0),
        ("damping.d2", "N", 0.0),
        ("damping.d3", "N s/m", 0.0),
    )
    return ParameterSpace(
        Parameter(_FIRST + name, unit, lower=lower, scale="log", tied=(_SECOND + name,)) for name, unit, lower in names
    )


def motion_space(*, play: bool) -> ParameterSpace:
    """What motions see besides: zeros of the encoders, friction of the guides, and where flanks change also the play.

    Args:
        play: whether the play is free; without a change of flanks it only shifts the zeros.
    """
    more = [
        Parameter("zero_1", "m", size=1e-5),
        Parameter("zero_2", "m", size=1e-5),
        Parameter("drive.table_friction.coulomb", "N", lower=0.0, size=100.0),
        Parameter("drive.table_friction.viscous", "N s/m", lower=0.0, size=100.0),
    ]
    if play:
        path = "backlash.play"
        more.append(Parameter(_FIRST + path, "m", lower=0.0, size=1e-5, tied=(_SECOND + path,)))
    return ParameterSpace([*mesh_space().parameters, *more])


def with_laws(drive: RackPinionDrive, stiffness: AbstractLoadLaw, damping: AbstractLoadLaw) -> RackPinionDrive:
    """The drive with other laws in both meshes.

    Args:
        drive: the drive.
        stiffness: k(F) of each drive train.
        damping: d(F) of each drive train.
    """

    def laws(d: RackPinionDrive) -> tuple:
        return (d.train_1.mesh.stiffness, d.train_2.mesh.stiffness, d.train_1.mesh.damping, d.train_2.mesh.damping)

    return eqx.tree_at(laws, drive, (stiffness, stiffness, damping, damping))


def with_zeros(table: DrivenTable, sweep: PreloadSweep) -> DrivenTable:
    """The table with its encoders' zeros guessed from the mean positions and torques of one sweep.

    Args:
        table: the driven table.
        sweep: a record at a preload that keeps both flanks in contact.
    """
    record = sweep.during()
    forces = table.drive.motor_force(sweep.motor_torques())
    zeros = []
    for i, train in enumerate((table.drive.train_1, table.drive.train_2)):
        apart = record.channel(f"position_{i + 1}") - record.channel("table_position")
        zeros.append(jnp.mean(apart) - train.mesh.deflection(forces[i]))
    return dataclasses.replace(table, zero_1=zeros[0], zero_2=zeros[1])


def response_evidence(
    sweeps: Sequence[PreloadSweep], responses: Sequence[FRF], drive: RackPinionDrive
) -> PreloadedResponseResidual:
    """Evidence from the complex responses of all sweeps, about the motor forces that their mean torques make.

    The friction of the motors adds to one force and takes from the other, and drops out of the totals to first order.

    Args:
        sweeps: one record for each preload, excited on the same velocity.
        responses: their responses V_T/V_1 at the same frequencies, with variance.
        drive: the drive, of which gear ratio and pinion diameter are used.

    Raises:
        InputError: no sweep, responses without variance.
    """
    if not sweeps or len(sweeps) != len(responses):
        raise InputError(f"{len(sweeps)} sweeps and {len(responses)} responses were given. Give one response for each.")
    grid = np.asarray(responses[0].frequency)
    for sweep, response in zip(sweeps, responses, strict=True):
        if not np.array_equal(np.asarray(response.frequency), grid) or sweep.velocity != sweeps[0].velocity:
            raise InputError(
                f"The sweep at {sweep.preload_percent:g} % has other frequencies or another velocity than the first. "
                "Estimate all responses with the same windows and band, on one velocity."
            )
    if any(response.variance is None for response in responses):
        raise InputError("A response has no variance to weight by. Estimate it from more than one window.")
    return PreloadedResponseResidual(
        responses[0].frequency,
        jnp.stack([response.values[0, 0] for response in responses]),
        jnp.stack([jnp.asarray(response.variance)[0, 0] for response in responses]),
        jnp.stack([drive.motor_force(sweep.motor_torques()) for sweep in sweeps]),
        sweeps[0].velocity,
    )


def cut(record: Record, begin: float, end: float) -> Record:
    """The samples of a record with begin <= t < end, on a time axis that starts at zero.

    Args:
        record: the record.
        begin: first time [s].
        end: time after the last one [s].

    Raises:
        InputError: if fewer than eight samples are left.
    """
    times = np.asarray(record.times)
    period = float(record.sample_period)
    first, last = np.searchsorted(times, [begin - 0.5 * period, end - 0.5 * period])
    rows = slice(int(first), int(last))
    channels = {name: np.asarray(samples)[rows] for name, samples in record.channels.items()}
    grid = np.arange(len(times[rows])) * period
    return Record.create(grid, channels, record.units, name=record.name)


@dataclasses.dataclass(frozen=True)
class DirectFits:
    """The same laws from three kinds of evidence; the model of each is a `DrivenTable`.

    Every piece of evidence is weighted by the scatter that it shows about its own fit, as many independent samples as
    its correlation leaves: what a model does not know, such as cogging, hangs together over thousands of samples. The
    scatter of motions is that of the table's position; preload forces are scaled with it. An error that is the same in
    all samples is no scatter: such intervals do not cover it. As information adds up, those of the joint fit are the
    narrowest by construction.
    """

    frf: FitResult
    """From the frequency responses of all preloads."""
    time: FitResult
    """From motions."""
    joint: FitResult
    """From both."""


def fit_direct(
    frf: PreloadedResponseResidual, time: Mapping[str, DrivenTableResidual], start: DrivenTable, space: ParameterSpace
) -> DirectFits:
    """Fit the laws to responses, to motions, and to both.

    Args:
        frf: evidence from responses.
        time: evidence from motions, by name.
        start: model to start from.
        space: what is free where motions take part, as `motion_space`.

    Raises:
        InputError: no motion, or as `fitting.fit.fit`.
    """
    if not time:
        raise InputError("There is no motion to fit to. Give at least one DrivenTableResidual by name.")
    names, evidence = ("responses", *time), (frf, *time.values())
    only_motions = [path for path in space.paths if path in motion_space(play=True).paths[len(mesh_space()) :]]
    silent = [np.inf] * len(time)

    def run(weights: Sequence[float], model: DrivenTable, hold: Sequence[str] = ()) -> FitResult:
        # One compiled program for all: what does not count has no weight.
        parts = JointResidual(tuple(map(Weighted, evidence, weights)), names)
        return fit(parts, model, space, hold=hold, variance="known")

    responses = run([1.0, *silent], start, only_motions)
    scatter = _scatter(evidence, responses, [1.0, *silent])[:1]
    responses = run([*scatter, *silent], responses.model, only_motions)
    weights = [np.inf] + [1.0] * len(time)
    motions = run(weights, start)
    for _ in range(_ROUNDS):
        weights = [np.inf, *_scatter(evidence, motions, weights)[1:]]
        motions = run(weights, motions.model)
    joint = run([*scatter, *weights[1:]], motions.model)
    return DirectFits(responses, motions, joint)


def _scatter(
    evidence: Sequence[PreloadedResponseResidual | DrivenTableResidual], result: FitResult, weights: Sequence[float]
) -> list[float]:
    """Rms of what a fit leaves of each piece, raised for the samples that its correlation takes away."""
    found, first = [], 0
    for part, weight in zip(evidence, weights, strict=True):
        values = result.residual[first : first + part.rows]
        first += part.rows
        if np.isinf(weight):
            found.append(np.inf)
            continue
        series = weight * np.asarray(part.series(jnp.asarray(values)))
        found.append(float(np.sqrt(np.mean(series**2) * correlation_time(series))))
    return found


def curve_intervals(result: FitResult, forces: Float[np.ndarray, "points"]) -> dict[str, float]:
    """Widest half 95 % intervals of k(F) and d(F) over some forces, relative to the curves [%], to first order.

    Args:
        result: fit of a `DrivenTable`.
        forces: forces [N].
    """
    at = jnp.asarray(forces)

    def curves(scaled: Array) -> Array:
        mesh = result.space.unpack(result.model, scaled).drive.train_1.mesh
        return jnp.stack([jnp.log(mesh.stiffness(at)), jnp.log(mesh.damping(at))])

    slopes = np.asarray(jax.jacfwd(curves)(jnp.asarray(result.scaled)))
    # What sits on a bound has no variance of its own.
    covariance = np.nan_to_num(result.scaled_covariance)
    deviation = np.sqrt(np.einsum("cfp,pq,cfq->cf", slopes, covariance, slopes))
    stiffness, damping = 196.0 * np.max(deviation, axis=1)
    return {"stiffness": float(stiffness), "damping": float(damping)}


def curve_errors(
    found: RackPinionDrive, truth: RackPinionDrive, forces: Float[np.ndarray, "points"]
) -> tuple[Float[Array, "points"], Float[Array, "points"]]:
    """Relative errors of k(F) and d(F) of the first drive train at some forces.

    Args:
        found: identified drive.
        truth: drive to compare with.
        forces: forces [N].
    """
    at = jnp.asarray(forces)
    one, other = found.train_1.mesh, truth.train_1.mesh
    return one.stiffness(at) / other.stiffness(at) - 1, one.damping(at) / other.damping(at) - 1
