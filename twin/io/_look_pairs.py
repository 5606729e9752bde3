"""What channels say of each other: copies, and speeds that are derivatives of positions."""

import itertools

import numpy as np

from twin.io._look_channel import Finding
from twin.io._look_roles import role_of
from twin.io.measurement import MeasuredChannel, Measurement

_MOST_CHANNELS, _LARGEST = 12, 200_000
_COPY, _DERIVATIVE = 1 - 1e-9, 0.95
_LARGEST_LAG = 0.05
_ORDER = {"position": 0, "speed": 1, "acceleration": 2}


def pair_findings(measurement: Measurement) -> list[Finding]:
    """Copies among the channels, and how speeds follow from positions.

    Args:
        measurement: the measurement; only its first channels over one time axis are compared.
    """
    chosen = [
        one
        for one in measurement
        if one.abscissa != "frequency" and one.values.dtype.kind == "f" and one.values.size >= 50
        if np.all(np.isfinite(one.values)) and np.ptp(one.values) > 0
    ][:_MOST_CHANNELS]
    found = []
    for one, other in itertools.combinations(chosen, 2):
        if one.values.size == other.values.size and (told := _copy(one, other)):
            found.append(told)
    for position, speed in itertools.permutations(chosen, 2):
        if position.times is None or position.times is not speed.times or not _may_follow(position, speed):
            continue
        if told := _derivative(position, speed):
            found.append(told)
    return found


def _copy(one: MeasuredChannel, other: MeasuredChannel) -> Finding | None:
    if np.array_equal(one.values, other.values):
        return Finding(other.name, "copy", f"is the same as {one.name!r}, sample by sample.")
    a, b = (values[:_LARGEST] - values[:_LARGEST].mean() for values in (one.values, other.values))
    size = np.sqrt((a @ a) * (b @ b))
    if size == 0 or abs(a @ b) < _COPY * size:
        return None
    return Finding(other.name, "copy", f"is {(a @ b) / (a @ a):.6g} times {one.name!r}.")


def _derivative(position: MeasuredChannel, speed: MeasuredChannel) -> Finding | None:
    """Sign, ratio and delay of a speed against the derivative of a position."""
    times = position.times
    if times is None or position.rate is None:
        return None
    times, x, v = times[:_LARGEST], position.values[:_LARGEST], speed.values[:_LARGEST]
    if np.any(np.diff(times) <= 0):
        return None
    slope = np.gradient(x, times)
    # Differences of a quantised position are rough; both are smoothed alike.
    width = max(3, x.size // 500)
    a, b = (np.convolve(y, np.hanning(width + 2)[1:-1], "same") for y in (slope, v))
    a, b = a - a.mean(), b - b.mean()
    if a @ a < 1e-12 * (slope @ slope):  # a straight line says nothing
        return None
    most = max(1, min(int(_LARGEST_LAG * position.rate), x.size // 10))
    lags, correlation, ratios = _correlation(a, b, most)
    best = int(np.argmax(np.abs(correlation)))
    if abs(correlation[best]) < _DERIVATIVE:
        return None
    lag = float(lags[best])
    if 0 < best < lags.size - 1:
        left, top, right = np.abs(correlation[best - 1 : best + 2])
        lag += 0.5 * (left - right) / (left - 2 * top + right) if left - 2 * top + right != 0 else 0.0
    ratio = float(ratios[best])
    told = f"follows the derivative of {position.name!r} times {ratio:.4g}"
    if ratio < 0:
        told += ", so one of their signs is turned"
    delay = lag / position.rate
    if abs(lag) > 0.3:
        told += f", {abs(delay):.3g} s {'after' if delay > 0 else 'before'} it"
    return Finding(speed.name, "derivative", f"{told}. Compare with the units.")


def _may_follow(position: MeasuredChannel, speed: MeasuredChannel) -> bool:
    """Whether one can be the derivative of the other, as far as their names tell: of a sine anything is."""
    lower, upper = (
        _ORDER.get((role_of(one.name, one.unit) or "").removesuffix("_setpoint")) for one in (position, speed)
    )
    if lower is None and upper is None:
        return not (role_of(position.name, position.unit) or role_of(speed.name, speed.unit))
    return upper == (upper if lower is None else lower + 1)


def _correlation(a: np.ndarray, b: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lags, correlation of a with b so much later, and least-squares factors; the ends of a are left out."""
    inner = a.copy()
    inner[:most], inner[-most:] = 0.0, 0.0
    length = 2 ** int(np.ceil(np.log2(2 * a.size)))
    crossed = np.fft.irfft(np.conj(np.fft.rfft(inner, length)) * np.fft.rfft(b, length), length)
    lags = np.arange(-most, most + 1)
    energy = np.concatenate([[0.0], np.cumsum(b**2)])
    own = energy[a.size - most + lags] - energy[most + lags]
    size = float(inner @ inner)
    return lags, crossed[lags] / np.sqrt(np.maximum(size * own, 1e-300)), crossed[lags] / max(size, 1e-300)
