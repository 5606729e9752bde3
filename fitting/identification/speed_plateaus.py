"""Stretches of constant speed in a record of several speeds."""

import numpy as np
from scipy import ndimage

from twin._checks import InputError, positive
from twin.record import Record

# Speeds below this share of the highest are standstill; standard errors by which means differ by chance.
_STILL, _CHANCE = 0.005, 4.0
# Standard deviations of white noise per median of its absolute differences.
_NORMAL = 1.4826 / np.sqrt(2.0)


def speed_plateaus(
    record: Record,
    *,
    velocity: str = "velocity",
    setpoint: str | None = None,
    shortest: float = 0.1,
    tolerance: float = 0.02,
) -> tuple[Record, ...]:
    """Cut a record where its speed is constant.

    At a sample of a plateau the mean speed just before and just after are equal within a tolerance, or within what
    noise makes of them; both means are taken over half of the shortest plateau.

    Args:
        record: the record.
        velocity: channel of the speed [m/s or rad/s].
        setpoint: channel of the set speed, by which plateaus are found if it is given.
        shortest: how long a plateau is at least [s].
        tolerance: share of the speed by which the means may differ [-].

    Returns:
        The plateaus in order of time, each without the margins in which the speed may still settle.

    Raises:
        InputError: a length or tolerance that is not positive, a missing channel, a length below 16 samples.
    """
    positive("shortest", shortest, "s")
    positive("tolerance", tolerance)
    speed = np.asarray(record.channel(setpoint or velocity))
    period = float(record.sample_period)
    half = round(0.5 * shortest / period)
    if half < 8:
        raise InputError(
            f"shortest is {shortest:g} s, {2 * half} samples of {record.name}, but a mean speed needs 16. Raise it."
        )
    if speed.size < 4 * half:
        return ()
    # The mean over `half` samples around k lies at k; those before and after k have their middles a quarter away.
    means = ndimage.uniform_filter1d(speed, half)
    step = half // 2
    difference = np.abs(np.roll(means, -step) - np.roll(means, step))
    noise = _NORMAL * float(np.median(np.abs(np.diff(speed))))
    allowed = np.maximum(tolerance * np.abs(means), _CHANCE * noise * np.sqrt(2 / half))
    flat = (difference <= allowed) & (np.abs(means) > _STILL * float(np.max(np.abs(means))))
    flat[:half] = flat[-half:] = False
    ends = np.flatnonzero(np.diff(np.concatenate([[0], flat.astype(int), [0]])))
    times = np.asarray(record.times)
    found = []
    for first, last in zip(ends[::2], ends[1::2], strict=True):
        # Within a margin the means still hold part of the ramp, by less than the tolerance.
        first, last = first + step, last - step
        if (last - first) * period >= 0.5 * shortest and last - first >= 16:
            found.append(record.slice(float(times[first]), float(times[last - 1]) + 0.5 * period))
    return tuple(found)
