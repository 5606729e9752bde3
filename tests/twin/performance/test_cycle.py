"""A positioning cycle: what it measures, that it can be swept, and what it says of runs that mean nothing."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin._checks import InputError
from twin.control import ClosedLoop, PositionVelocityPI
from twin.drives import mauro_axis
from twin.laws import ViscousFriction
from twin.paths import set_leaves
from twin.performance import PositioningCycle, cycle_performance
from twin.references import JerkLimitedMove
from twin.sweep import sweep

MOVE = (0.05, 0.2, 2.0, 50.0)
GAIN = "loop.controller.position_gain"


def rigid_cycle(**controller: float) -> PositioningCycle:
    axis = eqx.tree_at(lambda a: a.friction, mauro_axis(), ViscousFriction(0.05)).rigid()
    settings = {"position_gain": 20.0, "velocity_gain": 2.0, "integral_gain": 10.0, "feedforward": 0.0} | controller
    loop = ClosedLoop(axis, PositionVelocityPI(lead=axis.lead, **settings))
    return PositioningCycle.create(loop, JerkLimitedMove(*MOVE), dwell=0.6, step=2e-4)


def test_ends_after_move_and_dwell():
    cycle = rigid_cycle()
    end = float(cycle.move.duration()) + 0.6
    assert float(cycle.times[-1]) >= end
    assert float(cycle.times[-2]) < end
    assert float(cycle.target) == pytest.approx(0.05)


def test_energy_is_kinetic_energy_friction_and_copper_loss():
    cycle = rigid_cycle()
    run, axis = cycle.simulate(), cycle.loop.plant
    outputs = run.outputs
    taken = np.maximum(np.asarray(outputs.power), 0)
    expected = np.sum(0.5 * (taken[1:] + taken[:-1]) * np.diff(np.asarray(run.times)))
    found = cycle_performance(cycle)
    assert float(found.energy) == pytest.approx(expected, rel=1e-3)
    kinetic = 0.5 * float(axis.inertia) * float(jnp.max(outputs.motor_speed)) ** 2
    assert float(found.energy) > kinetic


def test_higher_gain_is_faster_and_takes_more_energy():
    table = sweep(rigid_cycle(), {GAIN: np.array([8.0, 12.0, 18.0])}, cycle_performance)
    assert np.all(np.diff(table["time"]) < 0)
    assert np.all(np.diff(table["energy"]) > 0)


def test_derivatives():
    cycle = rigid_cycle()

    @jax.jit
    def measures(gain: jax.Array) -> jax.Array:
        return jnp.stack(cycle_performance(set_leaves(cycle, {GAIN: gain})))

    step = 1e-4
    slope = jax.jacfwd(measures)(jnp.asarray(20.0))
    differences = (measures(jnp.asarray(20 + step)) - measures(jnp.asarray(20 - step))) / (2 * step)
    np.testing.assert_allclose(slope, differences, rtol=1e-4, atol=1e-9)


def test_voltage_limit_all_the_time_is_said():
    cycle = rigid_cycle(voltage_limit=0.02, integral_gain=0.0)
    cycle = dataclasses.replace(cycle, times=cycle.times[20:260] - cycle.times[20])
    cycle = eqx.tree_at(lambda c: c.move.start_position, cycle, jnp.asarray(0.5))
    with pytest.warns(UserWarning, match="voltage limit reached all the time"):
        cycle.simulate()


def test_bad_input():
    loop, move = rigid_cycle().loop, JerkLimitedMove(*MOVE)
    with pytest.raises(InputError, match="multiple of the step"):
        PositioningCycle.create(loop, move, dwell=0.1, step=3e-4)
    with pytest.raises(InputError, match="dwell"):
        PositioningCycle.create(loop, move, dwell=-1.0)
    with pytest.raises(InputError, match="times of the cycle"):
        dataclasses.replace(rigid_cycle(), times=jnp.zeros(5))
    with pytest.raises(InputError, match="must be a vector"):
        dataclasses.replace(rigid_cycle(), times=jnp.zeros((3, 2)))
    with pytest.raises(InputError, match="but the move and the window after it"):
        dataclasses.replace(rigid_cycle(), times=rigid_cycle().times[:40])
    with pytest.raises(InputError, match="Lengthen times or dwell"):
        PositioningCycle.create(loop, move, dwell=1e-3)
    with pytest.raises(InputError, match="window"):
        dataclasses.replace(rigid_cycle(), window=0.0)
