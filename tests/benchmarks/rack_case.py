"""The rack-and-pinion drive of Leipe et al. as every tool is given it: the same equations, numbers and reference.

Written for any kind of number: plain floats, NumPy arrays and CasADi symbols. The C loop has its own text.
"""

import functools
import itertools
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from twin.control import CascadeGains, ClosedLoop, PreloadCascade
from twin.drives import leipe_drive
from twin.drives.leipe import RATED_TORQUE, TORQUE_LIMIT
from twin.parameters import Parameter, ParameterSpace
from twin.references import JerkLimitedMove

TIMES = np.arange(301) * 0.01
"""Times at which the trajectories are wanted [s]; all jerk knots are among them."""
STATES = 8
"""Angles of the motors, table position, their speeds, both integral parts."""

_TRAIN = (
    "mesh.stiffness.k1",
    "mesh.stiffness.k2",
    "mesh.damping.d1",
    "mesh.damping.d2",
    "mesh.damping.d3",
    "mesh.backlash.play",
    "inertia",
    "friction.coulomb",
)
PATHS = (
    *[f"plant.train_1.{name}" for name in _TRAIN],
    *[f"plant.train_2.{name}" for name in _TRAIN],
    "plant.table_mass",
    "plant.table_friction.coulomb",
    "plant.table_friction.viscous",
    "controller.gains.preload",
)
"""What the variants vary; the Jacobian is over all but the last."""
PARAMETERS = len(PATHS) - 1
"""Parameters of the Jacobian."""

# What no variant varies.
_RADIUS = 0.08488 / 2 / 16
_VISCOUS, _MOTOR_WIDTH, _TABLE_WIDTH = 4e-4, 0.2, 5e-4
_FORCE_WIDTH, _CONTACT_WIDTH = 1.0, 1e-7
_POSITION_GAIN, _VELOCITY_GAIN, _RESET, _PRELOAD_GAIN, _AHEAD = 25.0, 700.0, 0.02, 5e-4, 3.3
_LIMIT, _ROUNDING = 30.0, 0.03


class Segment(NamedTuple):
    """A stretch of constant jerk of the reference."""

    begin: float
    """Its first time [s]."""
    end: float
    """Its last time [s]."""
    start: tuple[float, float, float, float]
    """Position, velocity, acceleration and jerk at its beginning [m, m/s, m/s², m/s³]."""

    def point(self, t: Any) -> tuple[Any, Any, Any]:
        """Position, velocity and acceleration at a time."""
        return along(t - self.begin, self.start)


def along(s: Any, start: Sequence[Any]) -> tuple[Any, Any, Any]:
    """Position, velocity and acceleration a time after the beginning of a segment."""
    x, v, a, j = start
    return x + s * (v + s * (a / 2 + s * (j / 6))), v + s * (a + s * (j / 2)), a + s * j


def closed_loop() -> ClosedLoop:
    """The drive under its continuous cascade at a preload of 10 %."""
    gains = CascadeGains(
        position_gain=_POSITION_GAIN,
        velocity_gain=_VELOCITY_GAIN,
        reset_time=_RESET,
        preload_gain=_PRELOAD_GAIN,
        preload=0.1 * RATED_TORQUE,
        rated_torque=RATED_TORQUE,
        torque_limit=TORQUE_LIMIT,
        acceleration_feedforward=_AHEAD,
    )
    return ClosedLoop(leipe_drive("tangent"), PreloadCascade(gains))


def move() -> JerkLimitedMove:
    """A metre at half a metre per second; it lasts from 0.3 s to 2.85 s."""
    return JerkLimitedMove(1.0, 0.5, 1.0, 20.0, start_time=0.3)


def space() -> ParameterSpace:
    """The parameters as the twin finds them."""
    return ParameterSpace([Parameter(path) for path in PATHS])


def nominal() -> np.ndarray:
    """Their values [SI]."""
    return np.asarray(space().pack(closed_loop()))


def variants(count: int, *, seed: int = 1) -> np.ndarray:
    """Values within 20 % of the nominal ones, shape (count, parameters).

    Args:
        count: number of variants.
        seed: of the sample.
    """
    return nominal() * np.random.default_rng(seed).uniform(0.8, 1.2, (count, len(PATHS)))


@functools.cache
def segments() -> tuple[Segment, ...]:
    """The reference in stretches of constant jerk, from the first to the last time."""
    reference = move()
    knots = [0.0, *np.asarray(reference.switching_times()).tolist(), float(TIMES[-1])]
    points = jax.vmap(reference)(jnp.asarray(knots))
    jerks = [float(reference.jerk(jnp.asarray(0.5 * (a + b)))) for a, b in itertools.pairwise(knots)]
    starts = np.stack([points.position, points.velocity, points.acceleration], axis=-1).tolist()
    return tuple(Segment(knots[i], knots[i + 1], (*starts[i], jerk)) for i, jerk in enumerate(jerks))


def motion(times: np.ndarray) -> np.ndarray:
    """Position, velocity and acceleration of the reference, shape (times, 3).

    Args:
        times: within the run [s].
    """
    stretches = segments()
    number = np.searchsorted([s.end for s in stretches[:-1]], times)
    starts = np.asarray([s.start for s in stretches])[number].T
    return np.stack(along(times - np.asarray([s.begin for s in stretches])[number], starts), axis=-1)


def constants(values: Sequence[Any]) -> list:
    """What the right-hand side needs of the parameters, once a run: for each train, then for table and controller."""
    found = []
    for train in (values[:8], values[8:16]):
        k1, k2, d1, d2, d3, play, inertia, coulomb = train
        slope = 1 - 1 / k2
        power = 1 / slope
        width = _FORCE_WIDTH**slope / (k1 * slope**k2)
        found += [(k1 * slope) ** power, (power - 1) / 2, width * width, d1, d2, d3, play / 2, 1 / inertia, coulomb]
    mass, coulomb, viscous, preload = values[16:]
    return [*found, 1 / mass, coulomb, viscous, preload]


def rate(state: Sequence[Any], wanted: Sequence[Any], given: Sequence[Any], sqrt: Any) -> list:
    """Time derivative of the state.

    Args:
        state: angles, table position, speeds, table velocity, integral parts.
        wanted: position, velocity and acceleration of the reference.
        given: as `constants` returns it.
        sqrt: square root for the kind of number at hand.
    """
    angle_1, angle_2, x, speed_1, speed_2, v, _, _ = state
    inverse_mass, coulomb, viscous = given[18:21]
    asked_1, asked_2, error_1, error_2 = _asked(state, wanted, given[21])
    limited_1, limited_2 = _clip(asked_1, sqrt), _clip(asked_2, sqrt)
    force_1 = _mesh(_RADIUS * angle_1 - x, _RADIUS * speed_1 - v, given[:7], sqrt)
    force_2 = _mesh(_RADIUS * angle_2 - x, _RADIUS * speed_2 - v, given[9:16], sqrt)
    lost_1 = given[8] * speed_1 / sqrt(speed_1 * speed_1 + _MOTOR_WIDTH**2) + _VISCOUS * speed_1
    lost_2 = given[17] * speed_2 / sqrt(speed_2 * speed_2 + _MOTOR_WIDTH**2) + _VISCOUS * speed_2
    guides = coulomb * v / sqrt(v * v + _TABLE_WIDTH**2) + viscous * v
    return [
        speed_1,
        speed_2,
        v,
        (_clip(limited_1, sqrt) - lost_1 - _RADIUS * force_1) * given[7],
        (_clip(limited_2, sqrt) - lost_2 - _RADIUS * force_2) * given[16],
        (force_1 + force_2 - guides) * inverse_mass,
        (_VELOCITY_GAIN * error_1 + limited_1 - asked_1) / _RESET,
        (_VELOCITY_GAIN * error_2 + limited_2 - asked_2) / _RESET,
    ]


def torques(state: Sequence[Any], wanted: Sequence[Any], given: Sequence[Any], sqrt: Any) -> list:
    """Torques of both motors [Nm]; arguments as of `rate`."""
    return [_clip(_clip(asked, sqrt), sqrt) for asked in _asked(state, wanted, given[21])[:2]]


def _asked(state: Sequence[Any], wanted: Sequence[Any], preload: Any) -> tuple[Any, Any, Any, Any]:
    """Torques that the velocity controllers ask for before their limit, and velocity errors."""
    _, _, x, speed_1, speed_2, _, integral_1, integral_2 = state
    common = _POSITION_GAIN * (wanted[0] - x) + wanted[1]
    ahead = _AHEAD * wanted[2]
    error_1, error_2 = common - _RADIUS * speed_1, common - _RADIUS * speed_2
    torque_1 = _VELOCITY_GAIN * error_1 + integral_1 + ahead
    torque_2 = _VELOCITY_GAIN * error_2 + integral_2 + ahead
    extra = _PRELOAD_GAIN * (preload - (torque_1 - torque_2) / 2) / (1 + _PRELOAD_GAIN * _VELOCITY_GAIN)
    push = _VELOCITY_GAIN * extra
    return torque_1 + push, torque_2 - push, error_1 + extra, error_2 - extra


def _clip(torque: Any, sqrt: Any) -> Any:
    upper, lower = torque + _LIMIT, torque - _LIMIT
    return 2 * _LIMIT * torque / (sqrt(upper * upper + _ROUNDING**2) + sqrt(lower * lower + _ROUNDING**2))


def _mesh(deflection: Any, closing: Any, given: Sequence[Any], sqrt: Any) -> Any:
    scale, exponent, width_squared, d1, d2, d3, half = given
    above, below = deflection - half, deflection + half
    upper, lower = sqrt(above * above + _CONTACT_WIDTH**2), sqrt(below * below + _CONTACT_WIDTH**2)
    indentation = deflection * (1 - 2 * half / (upper + lower))
    contact = 1 + above / (2 * upper) - below / (2 * lower)
    elastic = contact * scale * (indentation * indentation + width_squared) ** exponent * indentation
    return elastic + (d1 / (d2 + sqrt(elastic * elastic + _FORCE_WIDTH**2)) + d3) * contact * closing
