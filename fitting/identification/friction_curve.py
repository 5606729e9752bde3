"""Friction torque over speed, from the current that a motor draws at constant speeds (Mauro et al., section 5)."""

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import ArrayLike

from fitting.identification.friction_fit import fit_stribeck
from fitting.result import FitResult
from fitting.uncertainty import correlation_time
from twin._checks import InputError, positive
from twin.laws import TabulatedFriction
from twin.record import Record

if TYPE_CHECKING:
    import pandas as pd

# Parts of a record whose mean speeds are compared.
_PARTS = 8
# Standard errors by which a part's mean speed may be off by chance: one part in 16000 of a normal distribution.
_CHANCE = 4.0
_RPM = 60 / (2 * np.pi)


@dataclasses.dataclass(frozen=True, repr=False)
class FrictionCurve:
    """Measured friction torque at several speeds. Shows itself as a table in a notebook."""

    speeds: np.ndarray
    """Speeds of the motor or screw, increasing (points,) [rad/s]."""
    torques: np.ndarray
    """Mean torques, positive against positive motion (points,) [Nm]."""
    standard_errors: np.ndarray
    """Their standard errors, without that of the torque constant, which all points share (points,) [Nm]."""
    records: np.ndarray
    """Number of records in each point (points,)."""
    rejected: tuple[str, ...] = ()
    """What was left out, and why."""

    def to_dataframe(self) -> "pd.DataFrame":
        """Table of the points."""
        import pandas as pd

        return pd.DataFrame(
            {
                "speed [rad/s]": self.speeds,
                "speed [1/min]": _RPM * self.speeds,
                "friction torque [N m]": self.torques,
                "standard error [N m]": self.standard_errors,
                "records": self.records,
            }
        )

    def tabulated(self, *, width: float) -> TabulatedFriction:
        """The points as a law, with a steep but finite passage through zero speed.

        Where only one direction was measured, the other is taken to be its mirror image. Below the lowest speed the
        torque is held, and turns within ±width.

        Args:
            width: speed within which the torque turns, below the lowest measured one [rad/s].

        Raises:
            InputError: a width that is not positive, or not below the lowest speed.
        """
        positive("width", width, "rad/s")
        lowest = float(np.min(np.abs(self.speeds)))
        if not width < lowest:
            raise InputError(
                f"width is {width:g} rad/s, but the lowest measured speed is {lowest:g} rad/s, and the torque has to "
                "turn below it. Choose a smaller width, or measure at lower speeds."
            )
        speeds, torques = self.speeds, self.torques
        if np.all(speeds > 0) or np.all(speeds < 0):
            both = np.concatenate([speeds, -speeds]), np.concatenate([torques, -torques])
            order = np.argsort(both[0])
            speeds, torques = both[0][order], both[1][order]
        down, up = torques[speeds < 0], torques[speeds > 0]
        zero = [down[-1], 0.5 * (down[-1] + up[0]), up[0]]
        return TabulatedFriction(
            np.concatenate([speeds[speeds < 0], [-width, 0.0, width], speeds[speeds > 0]]),
            np.concatenate([down, zero, up]),
        )

    def stribeck(self, *, width: float | None = None, exponent: float = 2.0, variance: str = "estimated") -> FitResult:
        """A Stribeck law through the points, each weighted by its standard error.

        Args:
            width: speed over which the law turns at zero [rad/s]; a twentieth of the lowest speed if not given.
            exponent: shape of the fall from the breakaway torque [-], held.
            variance: "estimated" from how far the points lie off the law, or "known" where the standard errors are all.

        Returns:
            The fit; its model is a `StribeckFriction`. Where the points show no fall, breakaway and Coulomb torque are
            fitted as one, and the message says so.

        Raises:
            InputError: fewer than four speeds, or a width that is not positive.
        """
        return fit_stribeck(
            self.speeds, self.torques, self.standard_errors, width=width, exponent=exponent, variance=variance
        )

    def _repr_html_(self) -> str:
        table = self.to_dataframe().to_html(index=False, float_format=lambda x: f"{x:.5g}")
        return f"<div><p>{self._facts()}</p>{table}</div>"

    def __repr__(self) -> str:
        return f"{self.to_dataframe().to_string(index=False, float_format=lambda x: f'{x:.5g}')}\n{self._facts()}"

    def _facts(self) -> str:
        return " ".join([f"Friction at {self.speeds.size} speeds.", *self.rejected])


def friction_curve(
    records: "Sequence[Record | tuple[ArrayLike, ArrayLike]]",
    torque_constant: float,
    *,
    velocity: str = "velocity",
    current: str = "current",
    tolerance: float = 0.02,
    merge: float = 0.01,
    mean_of_directions: bool = False,
    skip: bool = False,
) -> FrictionCurve:
    """Friction torque over speed from records of motion at constant speed.

    At constant speed the torque of the motor is the friction. Its mean over a record has a standard error that allows
    for the correlation of the samples in time. Records at the same speed are merged by inverse variance; where they
    scatter more than their standard errors say, that of the point is what they scatter by.

    Args:
        records: records of constant motion, with speed [rad/s] and torque-generating current [A]; or pairs of speed,
            samples or one number, and samples of the current.
        torque_constant: K_T [Nm/A].
        velocity: channel of the speed.
        current: channel of the torque-generating current.
        tolerance: share of the mean speed by which an eighth of a record may be off it [-], beyond what noise explains.
        merge: speeds that differ by less than this share are one [-].
        mean_of_directions: take (T(ω) - T(-ω))/2 at speeds that were driven in both directions, which removes a
            constant load such as a weight; other speeds are left out.
        skip: leave records out that are not at constant speed, with a remark in the result, instead of an error.

    Returns:
        The curve.

    Raises:
        InputError: no records; a record that is not at constant speed, stands, is short or not finite, has another unit
            or no such channel; a torque constant that is not positive; no speed driven in both directions.
    """
    positive("torque_constant", torque_constant, "Nm/A")
    positive("tolerance", tolerance)
    if not 0 <= merge < 1:
        raise InputError(f"merge must be a share from 0 to below 1, but is {merge}.")
    means, rejected = [], []
    for i, record in enumerate(records):
        name, speed, amperes = _samples(record, i, velocity, current)
        fault = constant_speed_fault(speed, tolerance)
        if fault and not skip:
            raise InputError(
                f"{name} is not at constant speed: {fault}. Cut the constant part out by Record.slice, or leave such "
                "records out by skip=True."
            )
        if fault:
            rejected.append(f"{name} was left out: {fault}.")
            continue
        torque, error = _mean(torque_constant * amperes)
        means.append((float(np.mean(speed)), torque, error))
    if not means:
        raise InputError(" ".join(["There is no record at constant speed to read friction from.", *rejected]))
    points = _merged(sorted(means), merge)
    if mean_of_directions:
        points, alone = _folded(points, merge)
        rejected += alone
    speeds, torques, errors, counts = (np.asarray(column) for column in zip(*points, strict=True))
    return FrictionCurve(speeds, torques, errors, counts, tuple(rejected))


def _samples(record: object, i: int, velocity: str, current: str) -> tuple[str, np.ndarray, np.ndarray]:
    if isinstance(record, Record):
        name = f"Record {i} ({record.name})"
        speed, amperes = np.asarray(record.channel(velocity)), np.asarray(record.channel(current))
        for channel, unit in ((velocity, "rad/s"), (current, "A")):
            if record.units[channel] != unit:
                raise InputError(f"{name}: {channel} is in {record.units[channel]}, but {unit} is needed. Convert it.")
        return name, speed, amperes
    name = f"Record {i}"
    if not (isinstance(record, tuple) and len(record) == 2):
        raise InputError(f"{name} is a {type(record).__name__}, but a Record or a pair (speed, current) is needed.")
    speed, amperes = (np.asarray(values, dtype=float) for values in record)
    if amperes.ndim != 1 or amperes.size < 2 * _PARTS or speed.shape not in ((), amperes.shape):
        raise InputError(
            f"{name} has speeds of shape {speed.shape} and currents of shape {amperes.shape}. Give at least "
            f"{2 * _PARTS} samples of the current, and as many speeds or one."
        )
    if not (np.all(np.isfinite(speed)) and np.all(np.isfinite(amperes))):
        raise InputError(f"{name} holds samples that are NaN or infinite. Repair them or cut the record before them.")
    return name, np.broadcast_to(speed, amperes.shape), amperes


def constant_speed_fault(speed: np.ndarray, tolerance: float) -> str:
    """Why a motion is not at constant speed; empty if it is.

    Args:
        speed: speeds in order of time (samples,), at least 16 [rad/s].
        tolerance: as in `friction_curve`.
    """
    mean, error = _mean(speed)
    if abs(mean) <= _CHANCE * error or mean == 0:
        return f"its mean speed of {mean:.3g} rad/s cannot be told from standstill"
    parts = speed[: speed.size // _PARTS * _PARTS].reshape(_PARTS, -1)
    off = np.abs(parts.mean(axis=1) - mean)
    noise = np.array([_mean(part)[1] for part in parts])
    worst = int(np.argmax(off - _CHANCE * noise))
    if off[worst] <= max(tolerance * abs(mean), _CHANCE * noise[worst] if noise[worst] < off.max() else 0.0):
        return ""
    return f"part {worst + 1} of {_PARTS} is {100 * off[worst] / abs(mean):.3g} % off the mean of {mean:.4g} rad/s"


def _mean(values: np.ndarray) -> tuple[float, float]:
    """Mean and its standard error, with the samples' correlation in time."""
    mean = float(np.mean(values))
    rest = values - mean
    # A series knows of no slower correlation than half of itself.
    time = min(correlation_time(rest[None]), 0.5 * values.size)
    return mean, float(np.sqrt(np.mean(rest**2) * time / (values.size - time)))


def _merged(means: list[tuple[float, float, float]], merge: float) -> list[tuple[float, float, float, int]]:
    groups: list[list[tuple[float, float, float]]] = []
    for point in means:
        if groups and abs(point[0] - groups[-1][0][0]) <= merge * abs(point[0]) and point[0] * groups[-1][0][0] > 0:
            groups[-1].append(point)
        else:
            groups.append([point])
    return [_one(np.array(group)) for group in groups]


def _one(group: np.ndarray) -> tuple[float, float, float, int]:
    speed, torque, error = group.T
    # Records without noise, such as simulated ones, count alike.
    weight = 1 / error**2 if np.all(error > 0) else np.ones(len(group))
    total = float(np.sum(weight))
    mean = float(weight @ torque) / total
    inside = 1 / np.sqrt(total) if np.all(error > 0) else float(np.sqrt(np.mean(error**2) / len(group)))
    scatter = np.sqrt(float(weight @ (torque - mean) ** 2) / total / max(len(group) - 1, 1))
    return float(weight @ speed) / total, mean, float(max(inside, scatter)), len(group)


def _folded(
    points: list[tuple[float, float, float, int]], merge: float
) -> tuple[list[tuple[float, float, float, int]], list[str]]:
    """Means of both directions, and remarks on the speeds that have only one."""
    down, folded, alone = [p for p in points if p[0] < 0], [], []
    for point in (p for p in points if p[0] > 0):
        other = next((p for p in down if abs(p[0] + point[0]) <= merge * point[0]), None)
        if other is None:
            alone.append(f"{_RPM * point[0]:.4g} 1/min was left out: it was driven in one direction only.")
            continue
        down.remove(other)
        error = 0.5 * float(np.hypot(point[2], other[2]))
        folded.append((0.5 * (point[0] - other[0]), 0.5 * (point[1] - other[1]), error, point[3] + other[3]))
    alone += [f"{_RPM * p[0]:.4g} 1/min was left out: it was driven in one direction only." for p in down]
    if not folded:
        raise InputError("No speed was driven in both directions. Leave mean_of_directions out, or raise merge.")
    return folded, alone
