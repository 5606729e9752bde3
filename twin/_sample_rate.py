"""The sample rate of a record that is sampled evenly."""

import numpy as np

from twin._checks import InputError
from twin.record import Record

# How far a sample may miss its place in the grid, in sample periods.
_GRID_ROUNDING = 1e-2


def uniform_rate(record: Record) -> float:
    """Samples per second of a record [Hz].

    Raises:
        InputError: if the samples are not evenly spaced.
    """
    times = np.asarray(record.times)
    step = (times[-1] - times[0]) / (times.size - 1)
    miss = np.abs(times - times[0] - step * np.arange(times.size)).max()
    if miss > _GRID_ROUNDING * step:
        raise InputError(
            f"{record.name} is not sampled uniformly: a sample lies {miss:g} s from its place in a grid of {step:g} s. "
            "Resample it before taking spectra."
        )
    return float(1 / step)
