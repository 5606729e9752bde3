"""Records of a table that follows its motors linearly, at several preloads: what the chain and its parts are fed."""

import numpy as np
from scipy.signal.windows import tukey

from fitting.identification.preload_sweep import PreloadSweep
from twin.drives.leipe import RATED_TORQUE, leipe_drive
from twin.record import Record

RATE, START, DURATION = 2000.0, 0.5, 30.0
UNITS = {"position_1": "m", "position_2": "m", "table_position": "m", "torque_1": "N m", "torque_2": "N m"}
DRIVE = leipe_drive()
TIMES = np.arange(round((START + DURATION) * RATE)) / RATE
# What moves the table adds to one torque and takes from the other.
MEAN_TORQUE = 0.3


def totals(preload_percent):
    """Total stiffness and damping at the motor forces of a preload, and these forces."""
    forces = np.asarray(DRIVE.motor_force(RATED_TORQUE * preload_percent / 100 * np.array([1.0, -1.0]) + MEAN_TORQUE))
    mesh = DRIVE.train_1.mesh
    return float(np.sum(mesh.stiffness(forces))), float(np.sum(mesh.damping(forces))), forces


def sweep(preload_percent, noise=0.0, guides=0.0, seed=1):
    """A sweep from 5 to 250 Hz, filtered by the transfer function that the preload makes."""
    stiffness, damping, _ = totals(preload_percent)
    first = round(START * RATE)
    t = TIMES[first:] - START
    frequency = 5.0 + (250.0 - 5.0) / DURATION * t
    phase = 2 * np.pi * (5.0 + frequency) / 2 * t
    # Slowly in and out, and with rest behind, so that nothing comes around to the beginning.
    swept = tukey(t.size, 0.05) * 1e-3 * np.sin(phase) / (2 * np.pi * frequency)
    motor = np.concatenate([np.zeros(first), swept])
    s = 2j * np.pi * np.fft.rfftfreq(2 * motor.size, 1 / RATE)
    transfer = (damping * s + stiffness) / (float(DRIVE.table_mass) * s**2 + (damping + guides) * s + stiffness)
    table = np.fft.irfft(transfer * np.fft.rfft(motor, 2 * motor.size))[: motor.size] + 0.005 * TIMES
    random = np.random.default_rng(seed)
    channels = {
        "position_1": motor + 0.005 * TIMES,
        "position_2": motor + 0.005 * TIMES,
        "table_position": table + noise * random.standard_normal(table.size),
        "torque_1": MEAN_TORQUE + RATED_TORQUE * preload_percent / 100 + 0.02 * random.standard_normal(table.size),
        "torque_2": MEAN_TORQUE - RATED_TORQUE * preload_percent / 100 + 0.02 * random.standard_normal(table.size),
    }
    return PreloadSweep(preload_percent, Record.create(TIMES, channels, UNITS, name="a sweep"), START)
