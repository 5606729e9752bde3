"""An example axis with known parameters, a motion, what is free, and a simulated record with noise."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from twin.control import SampledLoop, SampledPositionVelocity
from twin.drives import ServoAxis
from twin.laws import StribeckFriction
from twin.parameters import Parameter, ParameterSpace
from twin.record import Record
from twin.references import JerkLimitedMove, SumReference
from twin.simulation import simulate
from twin.stepping import ConstantSteps

PERIOD = 1e-3
"""Period of the controller [s]."""
DEVIATION = {"position": 1e-6, "force": 1.0}
"""Standard deviation of the noise on the records [m, N]."""
STEPPING = ConstantSteps(substeps=4)
"""Integration steps between two ticks."""


def demo_axis() -> SampledLoop:
    """A ball-screw axis of 95 kg with Stribeck friction under a sampled cascade; all values chosen, none measured."""
    friction = StribeckFriction(
        coulomb=18.0, static=26.0, stribeck_velocity=8e-3, viscous=210.0, width=5e-4, exponent=1.0
    )
    axis = ServoAxis(mass=95.0, friction=friction, gain=35.0, offset=-3.0)
    return SampledLoop(axis, SampledPositionVelocity(160.0, 240.0, command_limit=10.0), PERIOD)


def demo_reference() -> SumReference:
    """Three moves there and back at different speeds, jerk-limited."""
    moves, start = [], 0.1
    for distance, speed in ((0.2, 0.25), (-0.2, 0.12), (0.05, 0.03), (-0.05, 0.015)):
        move = JerkLimitedMove(distance, speed, 2.0, 60.0, start_time=start)
        moves.append(move)
        start += float(move.duration()) + 0.15
    return SumReference(tuple(moves))


def demo_space() -> ParameterSpace:
    """What can be identified from a record of the axis."""
    return ParameterSpace(
        [
            Parameter("plant.mass", "kg", 10.0, 1000.0, scale="log"),
            Parameter("plant.friction.coulomb", "N", 0.0, 200.0),
            Parameter("plant.friction.static", "N", 0.0, 200.0),
            Parameter("plant.friction.stribeck_velocity", "m/s", 1e-3, 0.1, scale="log"),
            Parameter("plant.friction.viscous", "N s/m", 0.0, 2000.0),
            Parameter("plant.offset", "N", -50.0, 50.0),
        ]
    )


def make_record(loop: SampledLoop, reference: SumReference, seed: int = 1) -> Record:
    """Simulate and add noise.

    Args:
        loop: axis with its controller.
        reference: motion.
        seed: of the noise.
    """
    end = float(reference.switching_times()[-1]) + 0.2
    times = jnp.arange(int(end / PERIOD)) * PERIOD
    trajectory = eqx.filter_jit(simulate)(loop, reference, times, stepping=STEPPING)
    noise = np.random.default_rng(seed)
    channels = {
        name: np.asarray(trajectory.channel(name)) + sd * noise.standard_normal(times.size)
        for name, sd in DEVIATION.items()
    }
    return Record.create(np.asarray(times), channels, {"position": "m", "force": "N"}, name="simulated axis")
