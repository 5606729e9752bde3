"""Controllers and loops: the control law by hand, the held command, limits, injection, lag, and a continuous loop."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from reference_systems import ConstantInputs, ContinuousCascade, viscous_axis
from scipy.linalg import expm

from twin._checks import InputError
from twin.control import ClosedLoop, EncoderMemory, LaggedActuator, SampledLoop, SampledPositionVelocity
from twin.drives import DriveInputs, ServoAxisOutputs
from twin.references import MotionPoint, SampledReference, SampledSignal
from twin.simulation import simulate
from twin.stepping import AdaptiveSteps, ConstantSteps

T = 2e-3
TICKS = np.arange(60) * T
FINE = ConstantSteps(2, solver=diffrax.Tsit5())


@eqx.filter_jit
def run(system, reference, times, stepping=FINE, initial_state=None):
    return simulate(system, reference, times, stepping=stepping, initial_state=initial_state)


def _measured(position, velocity=0.0):
    zero = jnp.zeros(())
    return ServoAxisOutputs(jnp.asarray(position), jnp.asarray(velocity), zero, zero)


def _wanted(position):
    zero = jnp.zeros(())
    return MotionPoint(jnp.asarray(position), zero, zero)


def test_the_cascade_by_hand():
    """u = kv·(kp·(q_r - q) - q̇), with q̇ = (q_k - q_{k-2}) / 2T."""
    controller, period = SampledPositionVelocity(160.0, 240.0), jnp.asarray(T)
    memory = controller.initial_state(_measured(0.1), period)
    assert (float(memory.previous), float(memory.before)) == (0.1, 0.1)
    positions, before = [0.1, 0.1002, 0.1005, 0.1007], [0.1, 0.1, 0.1, 0.1002]
    for position, two_ago in zip(positions, before, strict=True):
        memory, command = controller.update(memory, _wanted(0.12), _measured(position), period)
        expected = 240.0 * (160.0 * (0.12 - position) - (position - two_ago) / (2 * T))
        assert float(command) == pytest.approx(expected, rel=1e-12)


def test_the_memory_starts_in_steady_motion_or_from_a_record():
    controller = SampledPositionVelocity(160.0, 240.0)
    memory = controller.initial_state(_measured(0.1, 0.5), jnp.asarray(T))
    _, command = controller.update(memory, _wanted(0.1), _measured(0.1, 0.5), jnp.asarray(T))
    assert float(command) == pytest.approx(-240.0 * 0.5, rel=1e-12)
    recorded = EncoderMemory(jnp.asarray(0.09), jnp.asarray(0.08))
    controller = SampledPositionVelocity(160.0, 240.0, history=recorded)
    _, command = controller.update(
        controller.initial_state(_measured(0.1, 0.5), jnp.asarray(T)), _wanted(0.1), _measured(0.1), jnp.asarray(T)
    )
    assert float(command) == pytest.approx(-240.0 * 0.02 / (2 * T), rel=1e-12)


@pytest.mark.parametrize(("error", "expected"), [(1.0, 10.0), (-1.0, -10.0), (1e-4, 3.84)])
def test_the_controller_limits_its_command(error, expected):
    controller = SampledPositionVelocity(160.0, 240.0, command_limit=10.0)
    memory = controller.initial_state(_measured(0.0), jnp.asarray(T))
    _, command = controller.update(memory, _wanted(error), _measured(0.0), jnp.asarray(T))
    assert float(command) == pytest.approx(expected)


def _motion(x, force):
    """The axis of 100 kg and 200 Ns/m under a constant force for one period, exactly."""
    decay, terminal = np.exp(-2 * T), force / 200.0
    velocity = terminal + (x[1] - terminal) * decay
    return np.array([x[0] + terminal * T + (x[1] - terminal) * (1 - decay) / 2, velocity])


def test_the_command_is_held_between_ticks():
    """Each state follows exactly from the one before by the command that was output there."""
    loop = SampledLoop(viscous_axis(gain=35.0), SampledPositionVelocity(50.0, 100.0), T)
    trajectory = run(loop, SampledReference(TICKS, 0.01 * np.sin(40 * TICKS)), TICKS)
    x = np.stack([trajectory.states.position, trajectory.states.velocity], axis=1)
    for k in range(len(TICKS) - 1):
        np.testing.assert_allclose(x[k + 1], _motion(x[k], 35.0 * float(trajectory.outputs.command[k])), atol=1e-13)


def test_injection_acts_behind_the_controller_and_the_amplifier_limits_their_sum():
    pulse = np.where((TICKS > 0.03) & (TICKS < 0.05), 3.0, 0.0)
    load = np.where(TICKS > 0.08, -20.0, 0.0)
    injection = SampledSignal(TICKS, DriveInputs(pulse, load), interpolation="hold")
    loop = SampledLoop(
        viscous_axis(gain=35.0),
        SampledPositionVelocity(50.0, 100.0, command_limit=4.0),
        T,
        injection,
        command_limit=5.0,
    )
    reference = SampledReference(TICKS, 0.01 + 0.0 * TICKS)
    trajectory = run(loop, reference, TICKS)
    position, command = (np.asarray(trajectory.channel(name)) for name in ("position", "command"))
    before = np.concatenate([position[:1], position[:1], position[:-2]])
    asked = np.clip(100.0 * (50.0 * (0.01 - position) - (position - before) / (2 * T)), -4.0, 4.0)
    np.testing.assert_allclose(command, np.clip(asked + pulse, -5.0, 5.0), atol=1e-9)
    assert np.any(command == 5.0)
    x = np.stack([position, trajectory.states.velocity], axis=1)
    for k in range(len(TICKS) - 1):
        np.testing.assert_allclose(x[k + 1], _motion(x[k], 35.0 * command[k] + load[k]), atol=1e-13)


def test_a_start_away_from_the_plants_own():
    loop = SampledLoop(viscous_axis(gain=35.0), SampledPositionVelocity(50.0, 100.0), T)
    start = loop.plant.initial_state()._replace(position=jnp.asarray(0.02), velocity=jnp.asarray(0.3))
    trajectory = run(loop, SampledReference(TICKS, 0.02 + 0.3 * TICKS), TICKS, initial_state=start)
    assert float(trajectory.states.position[0]) == 0.02
    # In steady motion at the start, the velocity controller alone brakes.
    assert float(trajectory.outputs.command[0]) == pytest.approx(-100.0 * 0.3, rel=1e-12)


@pytest.mark.parametrize("stepping", [AdaptiveSteps(rtol=1e-10, atol=1e-14), FINE], ids=["adaptive", "constant"])
def test_step_response_of_a_lagged_actuator(stepping):
    tau = 5e-3
    plant = LaggedActuator(viscous_axis(gain=35.0), tau)
    trajectory = run(plant, ConstantInputs(2.0, 0.0), TICKS, stepping)
    np.testing.assert_allclose(trajectory.states.actual, 2 * (1 - np.exp(-TICKS / tau)), atol=1e-7)
    # Behind the lag, v̇ = -2v + 0.7·(1 - exp(-t/τ)).
    expected = 0.35 * (1 - np.exp(-2 * TICKS)) - 0.7 / (2 - 1 / tau) * (np.exp(-TICKS / tau) - np.exp(-2 * TICKS))
    np.testing.assert_allclose(trajectory.states.plant.velocity, expected, atol=1e-9)
    np.testing.assert_array_equal(trajectory.outputs.command, 2.0)
    np.testing.assert_allclose(trajectory.outputs.force, 35 * trajectory.states.actual, rtol=1e-14)


def test_a_lagged_actuator_may_start_in_action_and_sit_in_a_sampled_loop():
    plant = LaggedActuator(viscous_axis(gain=35.0), 5e-3, initial_command=1.5)
    assert float(plant.initial_state().actual) == 1.5
    loop = SampledLoop(plant, SampledPositionVelocity(50.0, 100.0), T)
    trajectory = run(loop, SampledReference(TICKS, 0.0 * TICKS), TICKS)
    u, actual = np.asarray(trajectory.outputs.command), np.asarray(trajectory.states.actual)
    np.testing.assert_allclose(actual[1:], u[:-1] + (actual[:-1] - u[:-1]) * np.exp(-T / 5e-3), atol=1e-6)
    assert actual[0] == 1.5


@pytest.mark.parametrize("stepping", [AdaptiveSteps(rtol=1e-10, atol=1e-14), FINE], ids=["adaptive", "constant"])
def test_a_continuous_loop_against_the_matrix_exponential(stepping):
    """Constant set value: ẋ = A·x + b with x = (q, q̇, integral)."""
    loop = ClosedLoop(viscous_axis(gain=35.0, offset=4.0), ContinuousCascade(20.0, 80.0, 300.0))
    reference = SampledReference(TICKS[[0, -1]], np.array([0.02, 0.02]))
    trajectory = run(loop, reference, TICKS, stepping)
    a = np.zeros((4, 4))
    a[0, 1], a[2, 0], a[2, 3] = 1.0, -300.0, 300.0 * 0.02
    a[1] = np.array([-35 * 80 * 20, -35 * 80 - 200, 35, 35 * 80 * 20 * 0.02 - 4]) / 100
    exact = np.stack([(expm(a * t) @ [0, 0, 0, 1])[:3] for t in TICKS])
    np.testing.assert_allclose(trajectory.states.plant.position, exact[:, 0], atol=1e-9)
    np.testing.assert_allclose(trajectory.states.plant.velocity, exact[:, 1], atol=1e-8)
    np.testing.assert_allclose(trajectory.states.controller, exact[:, 2], atol=1e-7)
    command = 80 * (20 * (0.02 - exact[:, 0]) - exact[:, 1]) + exact[:, 2]
    np.testing.assert_allclose(trajectory.channel("command"), command, atol=1e-6)
    np.testing.assert_allclose(trajectory.channel("force"), 35 * command, atol=4e-5)


def test_a_closed_loop_is_a_plant_at_rest():
    loop = ClosedLoop(viscous_axis(gain=35.0), ContinuousCascade(20.0, 80.0, 300.0))
    state, rest = loop.initial_state(), loop.rest_inputs()
    assert isinstance(rest, MotionPoint)
    rates = loop.vector_field(jnp.asarray(0.0), state, rest)
    assert all(float(rate) == 0 for rate in jax.tree.leaves(rates))
    assert jax.tree.structure(rates) == jax.tree.structure(state)


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: SampledPositionVelocity(-1.0, 1.0), "position_gain"),
        (lambda: SampledPositionVelocity(1.0, np.nan), "velocity_gain"),
        (lambda: SampledPositionVelocity(1.0, 1.0, command_limit=0.0), "command_limit"),
        (lambda: SampledLoop(viscous_axis(), SampledPositionVelocity(1.0, 1.0), 0.0), "period"),
        (
            lambda: SampledLoop(viscous_axis(), SampledPositionVelocity(1.0, 1.0), T, command_limit=-1.0),
            "command_limit",
        ),
        (lambda: LaggedActuator(viscous_axis(), 0.0), "time_constant"),
    ],
)
def test_bad_input_is_named(make, named):
    with pytest.raises(InputError, match=named):
        make()
