"""The EMPS axis as a twin: its structure, what is known from the record, and the ladder of models tried on it."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from twin._checks import InputError
from twin.control import EncoderMemory, LaggedActuator, SampledLoop, SampledPositionVelocity
from twin.drives import DriveInputs, ServoAxis
from twin.io.emps import EmpsRecord
from twin.laws import DahlFriction, HarmonicForce, PolynomialForce, SumForce
from twin.parameters import Parameter, ParameterSpace
from twin.record import Record
from twin.references import SampledReference, SampledSignal
from twin.stepping import ConstantSteps

PERIOD = 1e-3
"""Period of the controller [s]."""
SCREW_LEAD = 2.5e-3
"""Travel per turn of the screw [m]."""
CYCLE = 6240
"""Samples per cycle of the reference."""
STEPPING = ConstantSteps(substeps=4)
"""Integration steps between two ticks."""
_TRAVEL = 0.125
_VOLTAGE_LIMIT = 10.0

_AXIS = "plant.plant."
_MASS, _OFFSET = _AXIS + "mass", _AXIS + "offset"
_FRICTION = _AXIS + "friction."
_RIPPLE = _AXIS + "position_force.terms.0."
_SLOPE = _AXIS + "position_force.terms.1.coefficients.1"
_DRAG = _FRICTION + "variation.terms.0."
_LEVEL = _FRICTION + "variation.terms.1.coefficients.1"
_LAG = "plant.time_constant"


class Rung(NamedTuple):
    """One model of the ladder."""

    name: str
    """What the model adds to the one before."""
    free: tuple[str, ...]
    """Paths that are free; the others of the space are held where they have no effect."""


def emps_space() -> ParameterSpace:
    """All parameters that any model of the ladder frees; bounds keep them physical, not close."""
    return ParameterSpace(
        [
            Parameter(_MASS, "kg", 10.0, 1000.0, size=10.0),
            Parameter(_FRICTION + "viscous", "N s/m", 0.0, 2000.0, size=20.0),
            Parameter(_FRICTION + "coulomb", "N", 0.0, 200.0, size=2.0),
            Parameter(_OFFSET, "N", -100.0, 100.0, size=1.0),
            Parameter(_FRICTION + "displacement", "m", 3e-7, 1e-3, scale="log"),
            Parameter(_LAG, "s", 1.5e-4, 2e-3, scale="log"),
            Parameter(_FRICTION + "asymmetry", "N s/m", -1000.0, 1000.0, size=20.0),
            Parameter(_FRICTION + "rise", "N", -100.0, 100.0, size=2.0),
            Parameter(_FRICTION + "rise_velocity", "m/s", 5e-4, 0.2, scale="log"),
            Parameter(_RIPPLE + "cosine.0", "N", -20.0, 20.0, size=0.5),
            Parameter(_RIPPLE + "sine.0", "N", -20.0, 20.0, size=0.5),
            Parameter(_DRAG + "cosine.0", "N", -20.0, 20.0, size=0.5),
            Parameter(_DRAG + "sine.0", "N", -20.0, 20.0, size=0.5),
            Parameter(_RIPPLE + "cosine.1", "N", -20.0, 20.0, size=0.5),
            Parameter(_RIPPLE + "sine.1", "N", -20.0, 20.0, size=0.5),
            Parameter(_SLOPE, "N", -20.0, 20.0, size=0.5),
            Parameter(_LEVEL, "N", -20.0, 20.0, size=0.5),
        ]
    )


def emps_ladder() -> tuple[Rung, ...]:
    """Models of growing size; each is the one before and a term that its residual asks for."""
    classical = (_MASS, _FRICTION + "viscous", _FRICTION + "coulomb", _OFFSET, _FRICTION + "displacement")
    steps = [
        ("viscous and Coulomb friction with pre-sliding, offset", classical),
        ("+ lag of the amplifier", (_LAG,)),
        ("+ viscous friction that differs by direction", (_FRICTION + "asymmetry",)),
        ("+ friction that rises with speed", (_FRICTION + "rise", _FRICTION + "rise_velocity")),
        ("+ force once per screw turn", (_RIPPLE + "cosine.0", _RIPPLE + "sine.0")),
        ("+ friction once per screw turn", (_DRAG + "cosine.0", _DRAG + "sine.0")),
        ("+ force twice per screw turn", (_RIPPLE + "cosine.1", _RIPPLE + "sine.1")),
        ("+ force that grows along the travel", (_SLOPE,)),
        ("+ friction that grows along the travel", (_LEVEL,)),
    ]
    rungs, free = [], ()
    for name, added in steps:
        free = (*free, *added)
        rungs.append(Rung(name, free))
    return tuple(rungs)


def emps_start(data: EmpsRecord) -> SampledLoop:
    """The axis before any fit: round numbers, terms beyond viscous and Coulomb friction switched off.

    What is taken from the record itself: first position, speed, the encoder memory of the controller and the
    amplifier's output at the first tick, all by solving the known control law for them at the first two ticks.

    Args:
        data: EMPS record with its controller's gains.
    """
    record = data.record
    position = np.asarray(record.channel("position"))
    voltage = np.asarray(record.channel("voltage"))
    wanted = np.asarray(record.channel("reference_position"))
    # u = kp·kv·(qr - q) - kv·q̇ solved for the speed that the controller saw.
    speed = data.kp * (wanted[:2] - position[:2]) - voltage[:2] / data.kv
    before, previous = position[:2] - 2 * PERIOD * speed
    zero = jnp.zeros(1)
    friction = DahlFriction(
        coulomb=15.0,
        viscous=200.0,
        displacement=1e-5,
        variation=SumForce((HarmonicForce(SCREW_LEAD, zero, zero), PolynomialForce(jnp.zeros(2), _TRAVEL, _TRAVEL))),
        initial_direction=1.0,
    )
    axis = ServoAxis(
        mass=100.0,
        friction=friction,
        gain=data.gtau,
        position_force=SumForce(
            (HarmonicForce(SCREW_LEAD, jnp.zeros(2), jnp.zeros(2)), PolynomialForce(jnp.zeros(2), _TRAVEL, _TRAVEL))
        ),
        initial_position=position[0],
        initial_velocity=speed[1],
    )
    amplifier = LaggedActuator(axis, time_constant=3e-4, initial_command=2 * voltage[0] - voltage[1])
    history = EncoderMemory(jnp.asarray(previous), jnp.asarray(before))
    controller = SampledPositionVelocity(data.kp, data.kv, history=history)
    injection = _pulses(record, pulse_gain(data)) if "pulse_voltage" in record.channels else None
    return SampledLoop(amplifier, controller, PERIOD, injection, command_limit=_VOLTAGE_LIMIT)


def emps_reference(record: Record) -> SampledReference:
    """The reference position that the controller was given."""
    return SampledReference(record.times, record.channel("reference_position"), interpolation="linear")


def emps_channels(record: Record) -> Record:
    """The record with the command named as the twin names it."""
    return record.with_channel("command", record.channel("voltage"), "V")


def on_record(model: SampledLoop, data: EmpsRecord) -> SampledLoop:
    """A fitted axis put at the start of another record; its parameters stay, its initial state is that record's.

    Args:
        model: fitted axis.
        data: the record to simulate.
    """

    def of_the_record(m: Any) -> tuple:
        axis = m.plant.plant
        return axis.initial_position, axis.initial_velocity, m.plant.initial_command, m.controller, m.injection

    return eqx.tree_at(of_the_record, model, of_the_record(emps_start(data)), is_leaf=lambda x: x is None)


def with_screw_phase(model: SampledLoop, origin: float | Array | np.ndarray) -> SampledLoop:
    """The axis with the phase of everything that repeats with the screw moved.

    Args:
        model: axis.
        origin: position at which the phase is zero [m].
    """
    where = lambda m: (  # noqa: E731
        m.plant.plant.position_force.terms[0].origin,
        m.plant.plant.friction.variation.terms[0].origin,
    )
    value = jnp.asarray(origin)
    return eqx.tree_at(where, model, (value, value))


def pulse_gain(data: EmpsRecord) -> float:
    """Volts per stored volt of the test pulses: the regression of what `voltage` exceeds the control law by.

    Args:
        data: record with pulses.

    Raises:
        InputError: record without pulses.
    """
    record = data.record
    if "pulse_voltage" not in record.channels:
        raise InputError(f"{record.name} has no channel 'pulse_voltage'. Use the test record.")
    q = np.asarray(record.channel("position"))
    wanted = np.asarray(record.channel("reference_position"))
    law = data.kp * data.kv * (wanted[2:] - q[2:]) - data.kv * (q[2:] - q[:-2]) / (2 * PERIOD)
    surplus = np.asarray(record.channel("voltage"))[2:] - law
    pulse = np.asarray(record.channel("pulse_voltage"))[2:]
    # Where the amplifier is at its limit the law says nothing.
    free = np.abs(law + pulse) < _VOLTAGE_LIMIT
    return float(pulse[free] @ surplus[free] / (pulse[free] @ pulse[free]))


def _pulses(record: Record, gain: float) -> SampledSignal:
    volts = gain * record.channel("pulse_voltage")
    return SampledSignal(record.times, DriveInputs(volts, jnp.zeros_like(volts)), interpolation="hold")
