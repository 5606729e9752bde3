"""Short records of a preloaded drive in a closed loop, made by the model that is fitted to them."""

import numpy as np
from rack_pinion_systems import Motion, gains, run

from twin.control import ClosedLoop, PreloadCascade
from twin.control.closed_loop import ClosedLoopState
from twin.control.preload import PreloadState
from twin.drives import DrivenTable
from twin.drives.leipe import RATED_TORQUE, leipe_drive
from twin.drives.rack_pinion_operation import steady_motion
from twin.record import Record
from twin.stepping import ConstantSteps

PERIOD, SAMPLES = 0.5e-3, 301
DRIVE = leipe_drive(play=20e-6)
ZEROS = (2e-4, -1e-4)
TRUTH = DrivenTable(DRIVE, *ZEROS)
UNITS = {"position_1": "m", "position_2": "m", "table_position": "m", "torque_1": "N m", "torque_2": "N m"}


def record(preload_percent, frequency=80.0, amplitude=2e-6, velocity=0.02):
    """A record and the true mesh forces as torques: even motion with an oscillation."""
    preload = RATED_TORQUE * preload_percent / 100
    loop = ClosedLoop(DRIVE, PreloadCascade(gains(preload=preload, velocity_gain=700.0)))
    state, inputs = steady_motion(loop.plant, preload, velocity=velocity)
    times = np.arange(SAMPLES) * PERIOD
    start = ClosedLoopState(state, PreloadState(*inputs.command))
    seen = run(loop, Motion(0.0, velocity, amplitude, frequency), times, start, ConstantSteps(8)).outputs
    channels = {name: np.asarray(getattr(seen, name)) for name in UNITS}
    for i, zero in enumerate(ZEROS):
        channels[f"position_{i + 1}"] = channels[f"position_{i + 1}"] + zero
    # The torques that are compared are those at the meshes.
    r = float(DRIVE.travel_per_radian)
    channels["torque_1"], channels["torque_2"] = r * np.asarray(seen.force_1), r * np.asarray(seen.force_2)
    return Record.create(times, channels, UNITS, name=f"{preload_percent:g} %")


def noisy(made, scatter, seed=1):
    """A record with noise on the table position."""
    random = np.random.default_rng(seed)
    table = made.channel("table_position") + scatter * random.standard_normal(made.times.size)
    return made.with_channel("table_position", table, "m")
