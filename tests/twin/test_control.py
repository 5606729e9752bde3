"""Sampled and continuous loops: the law by hand, limits, injection, lag of the amplifier, memory before the start."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array, Float

from twin._checks import InputError
from twin.control import (
    AbstractController,
    ClosedLoop,
    EncoderMemory,
    LaggedActuator,
    SampledLoop,
    SampledPositionVelocity,
)
from twin.drives import DriveInputs, ServoAxis
from twin.laws import ViscousFriction
from twin.references import JerkLimitedMove, SampledSignal
from twin.simulation import simulate
from twin.stepping import AdaptiveSteps, ConstantSteps

AXIS = ServoAxis(10.0, ViscousFriction(50.0), gain=2.0)
CONTROLLER = SampledPositionVelocity(position_gain=20.0, velocity_gain=100.0)
PERIOD = 1e-2
MOVE = JerkLimitedMove(0.1, 0.2, 1.0, 20.0)
TICKS = jnp.arange(60) * PERIOD
RUN = eqx.filter_jit(simulate)
FINE = ConstantSteps(substeps=16)


def by_hand(limit=np.inf, extra=0.0, memory=(0.0, 0.0)):
    """The loop in plain NumPy: exact zero-order hold of the viscous axis, the law as printed."""
    decay = np.exp(-50.0 / 10.0 * PERIOD)
    wanted = np.asarray([float(MOVE(t).position) for t in np.asarray(TICKS)])
    (previous, before), q, v, rows = memory, 0.0, 0.0, []
    for r in wanted:
        u = np.clip(100.0 * (20.0 * (r - q) - (q - before) / (2 * PERIOD)) + extra, -limit, limit)
        rows.append((q, u))
        previous, before = q, previous
        steady = 2.0 * u / 50.0
        q, v = q + steady * PERIOD + (v - steady) * (1 - decay) / 5.0, steady + (v - steady) * decay
    return np.asarray(rows).T


def test_sampled_loop_is_the_law_with_held_commands():
    run = RUN(SampledLoop(AXIS, CONTROLLER, PERIOD), MOVE, TICKS, stepping=FINE)
    position, command = by_hand()
    np.testing.assert_allclose(run.channel("position"), position, atol=1e-9)
    np.testing.assert_allclose(run.channel("command"), command, atol=1e-5)
    np.testing.assert_allclose(run.channel("force"), 2.0 * command, atol=1e-5)


def test_limit_acts_behind_the_injection():
    pulses = SampledSignal(TICKS, DriveInputs(jnp.full(60, 3.0), jnp.zeros(60)), interpolation="hold")
    run = RUN(SampledLoop(AXIS, CONTROLLER, PERIOD, pulses, command_limit=4.0), MOVE, TICKS, stepping=FINE)
    position, command = by_hand(limit=4.0, extra=3.0)
    assert np.max(command) == 4.0
    np.testing.assert_allclose(run.channel("command"), command, atol=1e-5)
    np.testing.assert_allclose(run.channel("position"), position, atol=1e-9)


def test_controllers_own_limit():
    limited = SampledPositionVelocity(20.0, 100.0, command_limit=1.5)
    run = RUN(SampledLoop(AXIS, limited, PERIOD), MOVE, TICKS, stepping=FINE)
    np.testing.assert_allclose(run.channel("command"), by_hand(limit=1.5)[1], atol=1e-5)


def test_history_is_what_the_encoder_read_before():
    history = EncoderMemory(jnp.asarray(-1e-3), jnp.asarray(-3e-3))
    controller = SampledPositionVelocity(20.0, 100.0, history=history)
    run = RUN(SampledLoop(AXIS, controller, PERIOD), MOVE, TICKS, stepping=FINE)
    np.testing.assert_allclose(run.channel("command"), by_hand(memory=(-1e-3, -3e-3))[1], atol=1e-5)


def test_lagged_actuator_follows_exponentially():
    axis = ServoAxis(10.0, ViscousFriction(0.0))
    plant = LaggedActuator(axis, time_constant=0.05)
    step = SampledSignal(jnp.asarray([0.0, 1.0]), DriveInputs(jnp.ones(2), jnp.zeros(2)))
    times = jnp.linspace(0.0, 0.3, 31)
    run = RUN(plant, step, times, stepping=AdaptiveSteps(rtol=1e-9, atol=1e-12))
    np.testing.assert_allclose(run.channel("force"), 1 - np.exp(-times / 0.05), atol=1e-8)
    np.testing.assert_allclose(run.channel("command"), 1.0)


class Proportional(AbstractController):
    """A P position controller, for the test of continuous loops."""

    gain: Float[Array, ""]

    def initial_state(self) -> tuple:
        return ()

    def vector_field(self, t: Any, state: Any, reference: Any, measurement: Any) -> tuple:
        return ()

    def command(self, t: Any, state: Any, reference: Any, measurement: Any) -> Any:
        return self.gain * (reference.position - measurement.position)


def test_continuous_loop_is_a_plant():
    """A mass on a P controller swings as a spring would."""
    loop = ClosedLoop(ServoAxis(10.0, ViscousFriction(0.0), initial_position=0.1), Proportional(jnp.asarray(1000.0)))
    still = JerkLimitedMove(0.0, 1.0, 1.0, 1.0)
    times = jnp.linspace(0.0, 2.0, 41)
    run = RUN(loop, still, times, stepping=AdaptiveSteps(rtol=1e-9, atol=1e-12))
    np.testing.assert_allclose(run.channel("position"), 0.1 * np.cos(10.0 * times), atol=1e-7)
    np.testing.assert_allclose(run.channel("force"), -100.0 * np.cos(10.0 * times), atol=1e-4)


def test_ticks_that_miss_the_period_are_refused():
    with pytest.raises(InputError, match=r"ticks of the sampled controller, 0.01 s apart, but tick 59"):
        simulate(SampledLoop(AXIS, CONTROLLER, PERIOD), MOVE, TICKS * 1.01)


def test_sampled_loops_are_not_stepped_adaptively():
    with pytest.raises(InputError, match="simulated with ConstantSteps"):
        simulate(SampledLoop(AXIS, CONTROLLER, PERIOD), MOVE, TICKS, stepping=AdaptiveSteps())


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ServoAxis(0.0, ViscousFriction(1.0)), r"mass must be positive \[kg\], but is 0"),
        (lambda: ServoAxis(-3.0, ViscousFriction(1.0)), r"mass must be positive \[kg\], but is -3"),
        (lambda: ServoAxis(float("nan"), ViscousFriction(1.0)), "mass must be finite"),
        (lambda: SampledLoop(AXIS, CONTROLLER, 0.0), "period of the sampled controller must be positive"),
        (lambda: SampledLoop(AXIS, CONTROLLER, PERIOD, command_limit=0.0), "command_limit must be above zero"),
        (lambda: SampledPositionVelocity(-1.0, 1.0), "position_gain must not be negative"),
        (lambda: LaggedActuator(AXIS, 0.0), "time_constant of the actuator must be positive"),
        (lambda: simulate(AXIS, MOVE, jnp.asarray([0.0])), "at least two times"),
        (lambda: simulate(AXIS, MOVE, jnp.asarray([0.0, 1.0, 1.0])), "times must increase strictly"),
    ],
)
def test_bad_input_is_named(make, message):
    with pytest.raises(InputError, match=message):
        make()
