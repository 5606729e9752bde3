"""Current loops and encoders around a plant: a lag of first order, the voltage limit, and rounding."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rack_pinion_systems import Motion, gains, run
from reference_systems import ConstantInputs, viscous_axis

from twin._checks import InputError
from twin.control import (
    ClosedLoop,
    CurrentLoop,
    Encoders,
    PreloadCascade,
)
from twin.drives.leipe import leipe_drive
from twin.stepping import ConstantSteps

F, R, L = 200.0, 1.4, 9e-3
TIMES = np.linspace(0.0, 5e-3, 251)
STEPPING = ConstantSteps(4, solver=diffrax.Tsit5())
LOOP = CurrentLoop.tuned(
    viscous_axis(gain=2.0), torque_constant=1.5, resistance=R, inductance=L, bandwidth=F, voltage_limit=600.0
)
DRIVE = leipe_drive()


def _step(loop, command):
    return run(loop, ConstantInputs(command, 0.0), TIMES, loop.initial_state(), STEPPING)


def test_a_tuned_loop_is_a_lag_of_first_order():
    result = _step(LOOP, 3.0)
    lag = 1 - np.exp(-2 * np.pi * F * TIMES)
    np.testing.assert_allclose(result.states.current, 2.0 * lag, atol=2e-6)
    np.testing.assert_allclose(result.outputs.force, 6.0 * lag, atol=6e-6)
    np.testing.assert_array_equal(result.outputs.command, 3.0)


def test_the_voltage_limit_is_kept_and_does_not_wind_up():
    """At full voltage i = U/R·(1 - exp(-R·t/L)) until the set current is near, and then no overshoot to speak of."""
    loop = eqx.tree_at(lambda x: x.voltage_limit, LOOP, jnp.asarray(50.0))
    current = np.asarray(_step(loop, 15.0).states.current)
    assert np.max(np.diff(current)) <= 50.0 / L * TIMES[1]
    full = 50.0 / R * (1 - np.exp(-R * TIMES / L))
    early = full < 5.0
    np.testing.assert_allclose(current[early], full[early], rtol=1e-3, atol=1e-3)
    assert np.max(current) < 10.2
    assert current[-1] == pytest.approx(10.0, rel=1e-2)


def test_each_motor_of_a_pair_has_its_own_current():
    loop = CurrentLoop.tuned(DRIVE, torque_constant=1.5, resistance=R, inductance=L, bandwidth=F, voltage_limit=600.0)
    inputs = loop.rest_inputs()
    inputs = eqx.tree_at(
        lambda u: (u.command.motor_1, u.command.motor_2), inputs, (jnp.asarray(3.0), jnp.asarray(-1.5))
    )
    state = loop.initial_state()
    rate = loop.vector_field(jnp.zeros(()), state, inputs)
    assert float(rate.current.motor_1) == pytest.approx(2 * np.pi * F * 2.0, rel=1e-6)
    assert float(rate.current.motor_2) == pytest.approx(-2 * np.pi * F * 1.0, rel=1e-6)
    assert float(rate.plant.speed_1) == 0.0
    state = state._replace(current=jax.tree.map(lambda u: u / 1.5, inputs.command))
    assert float(loop.outputs(jnp.zeros(()), state, inputs).torque_1) == pytest.approx(3.0, rel=1e-6)
    rest = loop.outputs(jnp.zeros(()), state, loop.rest_inputs())
    assert float(rest.torque_2) == pytest.approx(-1.5, rel=1e-6)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"torque_constant": 0.0}, "torque_constant of the current loop"),
        ({"resistance": -1.0}, "resistance of the current loop"),
        ({"inductance": np.inf}, "inductance of the current loop"),
        ({"bandwidth": 0.0}, "bandwidth of the current loop"),
        ({"voltage_limit": -1.0}, "voltage_limit of the current loop"),
    ],
)
def test_bad_current_loops_are_named(change, named):
    fields = {"torque_constant": 1.5, "resistance": R, "inductance": L, "bandwidth": F, "voltage_limit": 600.0}
    with pytest.raises(InputError, match=named):
        CurrentLoop.tuned(DRIVE, **{**fields, **change})


def test_a_negative_gain_and_a_zero_reset_time_are_named():
    with pytest.raises(InputError, match="gain of the current loop"):
        CurrentLoop(DRIVE, 1.5, R, L, -1.0, 1e-3, 600.0)
    with pytest.raises(InputError, match="reset_time of the current loop"):
        CurrentLoop(DRIVE, 1.5, R, L, 1.0, 0.0, 600.0)


def test_encoders_round_the_outputs_named_and_nothing_else():
    step = 1e-5
    seen = Encoders(DRIVE, {"position_1": step, "table_position": 2 * step})
    state = DRIVE.initial_state()._replace(
        angle_1=jnp.asarray(1.234567), angle_2=jnp.asarray(-0.7), table_position=jnp.asarray(-3.14159e-3)
    )
    inputs, t = DRIVE.rest_inputs(), jnp.zeros(())
    exact, read = DRIVE.outputs(t, state, inputs), seen.outputs(t, state, inputs)
    for name in exact._fields:
        there, here = float(getattr(exact, name)), float(getattr(read, name))
        if name in ("position_1", "table_position"):
            size = step if name == "position_1" else 2 * step
            assert here == pytest.approx(size * round(there / size), rel=1e-12)
            assert 0 < abs(here - there) <= size / 2
        else:
            assert here == there
    for a, b in zip(
        jax.tree.leaves(DRIVE.vector_field(t, state, inputs)),
        jax.tree.leaves(seen.vector_field(t, state, inputs)),
        strict=True,
    ):
        assert float(a) == float(b)


def test_bad_encoders_are_named():
    with pytest.raises(InputError, match="no output 'position'; it has position_1"):
        Encoders(DRIVE, {"position": 1e-6})
    with pytest.raises(InputError, match="step of position_2"):
        Encoders(DRIVE, {"position_2": 0.0})


def test_encoders_around_currents_around_the_drive_in_a_loop():
    """At rest, where every rate is zero."""
    current = CurrentLoop.tuned(
        DRIVE, torque_constant=1.5, resistance=R, inductance=L, bandwidth=F, voltage_limit=600.0
    )
    loop = ClosedLoop(Encoders(current, {"position_1": 1e-7, "table_position": 1e-6}), PreloadCascade(gains()))
    rate = loop.vector_field(jnp.zeros(()), loop.initial_state(), Motion()(jnp.zeros(())))
    assert float(rate.plant.current.motor_1) > 0
    assert float(rate.plant.current.motor_1) == -float(rate.plant.current.motor_2)
    assert all(float(x) == 0 for x in jax.tree.leaves(rate.plant.plant))
