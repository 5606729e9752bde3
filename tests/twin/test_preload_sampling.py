"""The sampled preload cascade by hand, tick by tick; bad input to both cascades."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rack_pinion_systems import Motion, gains

from twin._checks import InputError
from twin.control import SampledPreloadCascade
from twin.drives.leipe import leipe_drive
from twin.laws import smooth_clip

DRIVE = leipe_drive()
T = 1e-3
PERIOD = jnp.asarray(T)
LIMIT = 1e5  # so far away that it bends nothing


def _seen(k):
    """A drive on its way: both motors and the table a little apart."""
    state = DRIVE.initial_state()._replace(
        angle_1=jnp.asarray(0.3 + 0.02 * k + 1e-3 * k**2),
        angle_2=jnp.asarray(0.29 + 0.019 * k),
        table_position=jnp.asarray(8e-4 + 5e-5 * k),
        speed_1=jnp.asarray(20.0),
        speed_2=jnp.asarray(19.0),
    )
    return DRIVE.outputs(jnp.zeros(()), state, DRIVE.rest_inputs())


@eqx.filter_jit
def _update(controller, memory, wanted, seen):
    return controller.update(memory, wanted, seen, PERIOD)


def _commands(controller, ticks=7):
    memory, commands = controller.initial_state(_seen(0), PERIOD), []
    for k in range(ticks):
        memory, command = _update(controller, memory, Motion(1e-3, 0.05, 2e-3)(k * T), _seen(k))
        commands.append([float(command.motor_1), float(command.motor_2)])
    return np.array(commands), memory


def _by_hand(every, ticks=7):
    """The cascade of fig. 2 in difference form, without a limit."""
    r, asked, integral, commands = float(DRIVE.travel_per_radian), np.zeros(2), np.zeros(2), []
    before = np.array([0.3 * r - T * 20.0 * r, 0.29 * r - T * 19.0 * r])
    for k in range(ticks):
        wanted, seen = Motion(1e-3, 0.05, 2e-3)(k * T), _seen(k)
        if k % every == 0:
            correction = 30.0 * float(wanted.position - seen.table_position)
        at = np.array([float(seen.position_1), float(seen.position_2)])
        v_p = 1e-3 * (2.5 - 0.5 * (asked[0] - asked[1]))
        error = correction + float(wanted.velocity) + v_p * np.array([1.0, -1.0]) - (at - before) / T
        asked = 340.0 * error + integral + 0.7 * float(wanted.acceleration)
        integral = integral + 340.0 * error * T / 0.02
        before = at
        commands.append(asked)
    return np.array(commands)


@pytest.mark.parametrize("every", [1, 3])
def test_the_cascade_by_hand(every):
    controller = SampledPreloadCascade(gains(torque_limit=LIMIT, acceleration_feedforward=0.7), every)
    commands, memory = _commands(controller)
    # The limit bends a torque by 5e-7 of it.
    np.testing.assert_allclose(commands, _by_hand(every), rtol=3e-6)
    assert float(memory.tick) == 7 % every


def test_the_position_controller_holds_between_its_ticks():
    controller, held = SampledPreloadCascade(gains(), 4), []
    memory = controller.initial_state(_seen(0), PERIOD)
    for k in range(9):
        memory, _ = _update(controller, memory, Motion(0.01 * k)(0.0), _seen(k))
        held.append(float(memory.correction))
    assert held[0] == held[3] != held[4] == held[7] != held[8]


def test_delayed_torques_act_exactly_one_tick_later():
    now, _ = _commands(SampledPreloadCascade(gains()))
    later, _ = _commands(SampledPreloadCascade(gains(), delayed=True))
    np.testing.assert_array_equal(later[0], 0.0)
    np.testing.assert_array_equal(later[1:], now[:-1])


def test_a_saturated_controller_does_not_wind_up():
    controller = SampledPreloadCascade(gains(torque_limit=5.0))
    memory = controller.initial_state(_seen(0), PERIOD)
    seen, wanted = _seen(0), Motion(1.0)(0.0)
    for _ in range(200):
        memory, command = _update(controller, memory, wanted, seen)
        assert abs(float(command.motor_1)) <= 5.0
    assert float(memory.integral_1) == pytest.approx(5.0, rel=0.05)
    # As soon as the error turns its sign, so does the torque.
    _, command = _update(controller, memory, Motion(-1.0)(0.0), _seen(0))
    assert float(command.motor_1) < -4.9


@settings(deadline=None)
@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e3), st.floats(1e-6, 1.0))
def test_the_limit_is_odd_and_never_passed(value, limit, part):
    clipped = float(smooth_clip(value, limit, part * limit))
    assert abs(clipped) <= min(limit, abs(value)) * (1 + 1e-12)
    assert clipped == -float(smooth_clip(-value, limit, part * limit))
    assert float(smooth_clip(value + 0.1, limit, part * limit)) >= clipped - 1e-12 * limit
    if abs(value) < 0.5 * limit:
        assert clipped == pytest.approx(value, rel=part**2)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"position_gain": -1.0}, "position_gain"),
        ({"velocity_gain": -1.0}, "velocity_gain"),
        ({"preload_gain": -1e-3}, "preload_gain"),
        ({"reset_time": 0.0}, "reset_time"),
        ({"torque_limit": 0.0}, "torque_limit of the controller"),
        ({"torque_limit": np.inf}, "torque_limit of the controller"),
        ({"rated_torque": -12.5}, "rated_torque"),
        ({"preload": 12.6}, "preload is 12.6 Nm, beyond the rated torque of 12.5 Nm"),
        ({"preload": -12.6}, "preload is -12.6 Nm"),
        ({"preload": np.nan}, "preload"),
        ({"velocity_feedforward": np.inf}, "velocity_feedforward"),
        ({"feedback": "scale"}, 'feedback must be "table" or "motors", but is \'scale\''),
    ],
)
def test_bad_gains_are_named(change, named):
    with pytest.raises(InputError, match=named):
        gains(**change)


def test_position_ticks_are_counted_from_one():
    with pytest.raises(InputError, match="position_every must be at least 1"):
        SampledPreloadCascade(gains(), 0)


def test_preload_loop_that_swings_up_is_refused():
    with pytest.raises(InputError, match="must stay below 1"):
        SampledPreloadCascade(gains(preload_gain=2e-3, velocity_gain=700.0))
