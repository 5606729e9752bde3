"""How much a measured channel scatters, read from the record itself, where nobody has said."""

import numpy as np

# Third differences take out what is smooth; their weights 1, -3, 3, -1 enlarge white noise by the root of 20.
_WEIGHT = np.sqrt(20.0)
_NORMAL = 1.4826
# What a channel without any scatter, a simulated one, is taken to scatter by, relative to its range.
LEAST = 1e-9


def noise_deviation(values: np.ndarray) -> float:
    """Standard deviation of the white noise on a channel that is otherwise smooth from sample to sample.

    The median of its third differences, so that a few jumps do not count; at least the rounding of its own steps, and a
    billionth of its range.

    Args:
        values: samples (samples,), at least 8.
    """
    found = _NORMAL * float(np.median(np.abs(np.diff(values, 3)))) / _WEIGHT
    levels = np.unique(values)
    # Steps of a counter are all multiples of the smallest; noise has as many levels as samples.
    step = float(np.min(np.diff(levels))) if 1 < levels.size < values.size / 4 else 0.0
    spread = float(np.ptp(values))
    return max(found, step / np.sqrt(12), LEAST * spread, np.finfo(float).tiny)
