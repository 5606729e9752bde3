"""A stand-in for the bench of Leipe et al.: a simulated drive that is richer than any model fitted to its records.

It has what a model will not know: friction that rises towards standstill, cogging, encoders of finite resolution, a
controller that answers one tick late, current loops, noise on the torques. Stiffness and damping are the published ones
(eq. 6, 10). What it shares with the model: the form of both laws and of the backlash, equal drive trains, the mass of
the table, the settings of the controllers, and encoders that start at zero. So the figures say what the procedures
lose, not what a machine that differs in these would add.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from twin.control import CascadeGains, CurrentLoop, Encoders, SampledLoop, SampledPreloadCascade
from twin.drives import AgainstStop, RackPinionDrive, RackPinionInputs, TorquePair, leipe_drive
from twin.drives.leipe import GEAR_RATIO, PINION_DIAMETER, RATED_TORQUE, TORQUE_LIMIT
from twin.laws import HarmonicForce, StribeckFriction
from twin.plant import AbstractPlant
from twin.record import Record
from twin.references import AbstractReference, ConstantVelocity, SampledSignal, SineSweep, SumReference
from twin.simulation import simulate
from twin.stepping import ConstantSteps

PERIOD = 250e-6
"""Period of the velocity controllers [s]; records hold every tick."""
STEPPING = ConstantSteps(substeps=1)
"""One step a tick: no mode of the drive or of its current loops is faster."""
CHANNELS = {
    "position_1": "m",
    "position_2": "m",
    "table_position": "m",
    "torque_1": "N m",
    "torque_2": "N m",
}
"""What the bench records."""
TORQUE_NOISE = 0.02
"""Standard deviation of the noise on the torques, from the currents [Nm]."""
TORQUE_CONSTANT = 1.5
"""Chosen: torque per current of the motors [Nm/A]."""
RESISTANCE = 1.0
"""Chosen: resistance of a winding [Ohm]."""
# Motor encoders of 24 bit behind the gearboxes, and a scale of 0.1 µm; all chosen.
_MOTOR_STEP = 2 * np.pi / 2**24 * PINION_DIAMETER / (2 * GEAR_RATIO)
_ENCODERS = {"position_1": _MOTOR_STEP, "position_2": _MOTOR_STEP, "table_position": 1e-7}


def bench_gains(preload_percent: float | Array) -> CascadeGains:
    """Settings of the cascade; chosen, as none are published.

    Args:
        preload_percent: preload in per cent of the rated torque.

    Raises:
        InputError: a preload beyond the rated torque.
    """
    return CascadeGains(
        position_gain=25.0,
        velocity_gain=700.0,
        reset_time=0.02,
        preload_gain=5e-4,
        preload=RATED_TORQUE * preload_percent / 100,
        rated_torque=RATED_TORQUE,
        torque_limit=TORQUE_LIMIT,
        acceleration_feedforward=0.0,
    )


def bench_loop(drive: RackPinionDrive, gains: CascadeGains, *, delayed: bool) -> SampledLoop:
    """A drive under the bench's sampled cascade and current loops.

    Args:
        drive: the drive.
        gains: settings of the cascade.
        delayed: whether torques act one tick late.
    """
    return SampledLoop(_currents(drive), SampledPreloadCascade(gains, position_every=4, delayed=delayed), PERIOD)


def _currents(plant: AbstractPlant) -> CurrentLoop:
    return CurrentLoop.tuned(
        plant,
        torque_constant=TORQUE_CONSTANT,
        resistance=RESISTANCE,
        inductance=0.01,
        bandwidth=400.0,
        voltage_limit=300.0,
    )


def bench_drive() -> RackPinionDrive:
    """The richer drive: friction that rises towards standstill, and cogging of motors and gears."""
    drive = leipe_drive()
    trains = []
    for train, phase in ((drive.train_1, 0.4), (drive.train_2, 2.1)):
        friction = StribeckFriction(
            coulomb=0.14, static=0.2, stribeck_velocity=0.5, viscous=5e-4, width=0.05, exponent=1.0
        )
        # Five pole pairs, and six times as many slots.
        cogging = HarmonicForce(2 * np.pi / 5, [0.05, 0, 0, 0, 0, 0.04], [0.0] * 6, origin=phase)
        trains.append(dataclasses.replace(train, friction=friction, cogging=cogging))
    guides = StribeckFriction(
        coulomb=110.0, static=160.0, stribeck_velocity=1e-3, viscous=300.0, width=2e-4, exponent=2.0
    )
    return dataclasses.replace(drive, train_1=trains[0], train_2=trains[1], table_friction=guides)


def bench(preload_percent: float) -> SampledLoop:
    """The whole bench at a preload.

    Args:
        preload_percent: preload in per cent of the rated torque.

    Raises:
        InputError: a preload beyond the rated torque.
    """
    loop = bench_loop(bench_drive(), bench_gains(preload_percent), delayed=True)
    return dataclasses.replace(loop, plant=Encoders(loop.plant, _ENCODERS))


class Measurement(eqx.Module):
    """What a bench recorded, and what only a simulated one can tell."""

    record: Record
    """The record: positions of both motors and the table, both torques."""
    forces: Float[Array, "2 samples"]
    """True forces through the meshes [N]."""


def measure(
    preload_percents: Sequence[float], reference: AbstractReference, duration: float, *, seed: int
) -> list[Measurement]:
    """Records of one motion at several preloads, with noise.

    Args:
        preload_percents: preloads in per cent of the rated torque.
        reference: the motion.
        duration: length of each record [s].
        seed: of the noise.

    Raises:
        InputError: a preload beyond the rated torque.
    """
    times = jnp.arange(round(duration / PERIOD)) * PERIOD
    random = np.random.default_rng(seed)
    found = []
    for percent in preload_percents:
        outputs = _run(bench(percent), reference, times, STEPPING)
        record = _record(outputs, np.asarray(times), random, f"bench at {percent:g} % preload")
        found.append(Measurement(record, jnp.stack([outputs.force_1, outputs.force_2])))
    return found


def measure_against_stop(highest_torque: float, duration: float, *, seed: int) -> Record:
    """A record of motor 1 ramping its torque slowly up and down, on both sides, while the table rests against a stop.

    Args:
        highest_torque: torque at which the ramps turn [Nm].
        duration: of the record [s].
        seed: of the noise.
    """
    times = jnp.arange(round(duration / PERIOD)) * PERIOD
    torque = highest_torque * jnp.interp(times / duration, jnp.linspace(0, 1, 5), jnp.asarray([0.0, 1, 0, -1, 0]))
    stopped = AgainstStop(bench_drive(), stiffness=2e9, damping=1e5)
    plant = Encoders(_currents(stopped), _ENCODERS)
    signal = SampledSignal(times, RackPinionInputs(TorquePair(torque, 0 * torque), 0 * torque))
    outputs = _run(plant, signal, times, ConstantSteps(substeps=2))
    return _record(outputs, np.asarray(times), np.random.default_rng(seed), "bench against a stop")


def _record(outputs: Any, times: np.ndarray, random: np.random.Generator, name: str) -> Record:
    channels = {name: np.asarray(getattr(outputs, name)) for name in CHANNELS}
    for torque in ("torque_1", "torque_2"):
        channels[torque] = channels[torque] + TORQUE_NOISE * random.standard_normal(times.size)
    return Record.create(times, channels, CHANNELS, name=name)


@eqx.filter_jit
def _run(loop: Any, reference: AbstractReference, times: Array, stepping: ConstantSteps) -> Any:
    trajectory = simulate(loop, reference, times, stepping=stepping)
    return jax.tree.map(jnp.asarray, trajectory.outputs)


def sweep_reference(duration: float, start: float = 1.0) -> SumReference:
    """0.1 to 400 Hz with 1 mm/s on 5 mm/s (section V).

    Args:
        duration: of the sweep [s].
        start: time at which it begins, when the preload has settled [s].

    Raises:
        InputError: a duration that is not positive.
    """
    sweep = SineSweep(0.1, 400.0, duration, 0.001, start_time=start)
    sweep.check_sampled(1 / PERIOD)
    return SumReference((ConstantVelocity(0.005, 0.2), sweep))
