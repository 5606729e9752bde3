"""The EMPS axis as every tool is given it: the same equations, numbers, controller and reference."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from twin.control.closed_loop import SampledLoop
from twin.control.lagged_actuator import LaggedActuator
from twin.control.position_velocity import SampledPositionVelocity
from twin.drives.servo_axis import ServoAxis
from twin.io.data import DataNotFound
from twin.io.emps import read_emps
from twin.laws import CoulombViscousFriction, DahlFriction
from twin.parameters import Parameter, ParameterSpace
from twin.references import JerkLimitedMove

TICKS = 24_841
PERIOD = 1e-3
POSITION_GAIN = 160.18
VELOCITY_GAIN = 243.45
COMMAND_LIMIT = 10.0

_GAIN = 35.15
_DAHL_WIDTH = 1e-5
_RISE_VELOCITY = 0.01
_RATE_LIMIT = 500.0


@dataclass(frozen=True)
class Case:
    """One axis under the EMPS controller, with its free parameters."""

    name: str
    """Name in the table."""
    loop: SampledLoop
    """The twin's model."""
    space: ParameterSpace
    """Free parameters, in the order in which `rate` gets their values."""
    rate: Callable[[Sequence[Any], Any, Sequence[Any], Any], list]
    """The same model for the other tools: function of (state, command, values, functions), where `functions` is the
    module that has `sqrt` and `expm1` for the kind of number at hand."""
    start: tuple[float, ...]
    """Initial state."""
    wanted: np.ndarray
    """Reference position at the ticks, shape (ticks,) [m]."""
    source: str
    """Where the reference comes from."""
    substeps: int
    """Steps per tick with which the twin is as accurate as the most accurate peer that has sensitivities."""

    @property
    def ticks(self) -> int:
        """Number of controller ticks."""
        return self.wanted.size

    @property
    def times(self) -> np.ndarray:
        """Times of the ticks [s]."""
        return np.arange(self.ticks) * PERIOD

    @property
    def vector(self) -> np.ndarray:
        """Scaled vector of the free parameters at which all is computed, shape (parameters,)."""
        return np.asarray(self.space.pack(self.loop))

    def values(self, vector: Sequence[Any], functions: Any) -> list:
        """From the scaled vector to values in SI, for any kind of number."""
        scales = [p.scale for p in self.space.parameters]
        return [functions.exp(x) if scale == "log" else x for x, scale in zip(vector, scales, strict=True)]

    def first(self, ticks: int) -> "Case":
        """The same case over its first ticks only."""
        return replace(self, wanted=self.wanted[:ticks])


def rigid_case() -> Case:
    """A mass with smoothed Coulomb and viscous friction; six parameters, published values but for the chosen width."""
    wanted, source = _reference()
    friction = CoulombViscousFriction(coulomb=20.4, viscous=203.5, width=1e-3)
    axis = ServoAxis(mass=95.1, friction=friction, gain=_GAIN, offset=-3.17, initial_position=wanted[0])
    space = _space(("mass", "friction.coulomb", "friction.viscous", "friction.width", "offset", "gain"), "plant")
    return Case("rigid axis", _loop(axis), space, _rigid_rate, (wanted[0], 0.0), wanted, source, substeps=4)


def dahl_case() -> Case:
    """The mass with Dahl friction behind a lagged actuator; eight parameters, friction and lag with chosen values."""
    wanted, source = _reference()
    friction = DahlFriction(
        coulomb=17.0,
        viscous=200.0,
        displacement=2e-5,
        asymmetry=10.0,
        rise=4.0,
        rise_velocity=_RISE_VELOCITY,
        rate_limit=_RATE_LIMIT,
        width=_DAHL_WIDTH,
    )
    axis = ServoAxis(mass=95.1, friction=friction, gain=_GAIN, offset=-3.17, initial_position=wanted[0])
    plant = LaggedActuator(axis, time_constant=1e-3)
    names = ("mass", "offset", "coulomb", "viscous", "asymmetry", "displacement", "rise")
    paths = [n if n in ("mass", "offset") else f"friction.{n}" for n in names]
    space = ParameterSpace([*_space(paths, "plant.plant").parameters, Parameter("plant.time_constant", scale="log")])
    start = (wanted[0], 0.0, 0.0, 0.0)
    return Case("Dahl friction and lag", _loop(plant), space, _dahl_rate, start, wanted, source, substeps=8)


def _rigid_rate(state: Sequence[Any], command: Any, values: Sequence[Any], functions: Any) -> list:
    _, v = state
    mass, coulomb, viscous, width, offset, gain = values
    friction = coulomb * v / functions.sqrt(v * v + width * width) + viscous * v
    return [v, (gain * command - friction - offset) / mass]


def _dahl_rate(state: Sequence[Any], command: Any, values: Sequence[Any], functions: Any) -> list:
    _, v, z, actual = state
    mass, offset, coulomb, viscous, asymmetry, displacement, rise, lag = values
    speed = functions.sqrt(v * v + _DAHL_WIDTH**2)
    level = coulomb - rise * functions.expm1(-speed / _RISE_VELOCITY) + viscous * speed
    friction = z * level + z * z * asymmetry * speed
    limited = v / functions.sqrt(1 + (v / (_RATE_LIMIT * displacement)) ** 2)
    turning = (limited - functions.sqrt(limited * limited + _DAHL_WIDTH**2) * z) / displacement
    return [v, (_GAIN * actual - friction - offset) / mass, turning, (command - actual) / lag]


def _loop(plant: Any) -> SampledLoop:
    return SampledLoop(plant, SampledPositionVelocity(POSITION_GAIN, VELOCITY_GAIN, COMMAND_LIMIT), PERIOD)


def _space(names: Sequence[str], holder: str) -> ParameterSpace:
    logarithmic = ("friction.width", "friction.displacement")
    return ParameterSpace(
        [Parameter(f"{holder}.{name}", scale="log" if name in logarithmic else "linear") for name in names]
    )


def _reference() -> tuple[np.ndarray, str]:
    try:
        wanted = np.asarray(read_emps().record.channel("reference_position"))
    except DataNotFound:
        return _synthetic(), "synthetic jerk-limited moves (the EMPS record was not found)"
    return wanted, "EMPS training record"


def _synthetic() -> np.ndarray:
    """There and back over 0.2 m, with rests, for as many ticks as the record has [m]."""
    move = JerkLimitedMove(distance=0.2, velocity_limit=0.1, acceleration_limit=0.5, jerk_limit=10.0, start_time=0.25)
    there = np.asarray(jax.vmap(move)(jnp.arange(0.0, 3.0, PERIOD)).position)
    return np.resize(np.concatenate([there, there[::-1]]), TICKS)
