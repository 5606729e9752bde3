"""The preload cascade around the rack-and-pinion bench: steady state, limits, small signals, sampling, derivatives."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rack_pinion_systems import Motion, both, firm, gains, mixed_drive, negative, run
from scipy.linalg import expm

from twin.control import ClosedLoop, PreloadCascade, SampledLoop, SampledPreloadCascade
from twin.control.closed_loop import ClosedLoopState
from twin.control.preload import PreloadState
from twin.drives.rack_pinion_operation import steady_motion
from twin.linear import linearise
from twin.simulation import simulate
from twin.stepping import ConstantSteps

STEPPING = ConstantSteps(4)
TIMES = np.linspace(0.0, 0.2, 401)
ZERO = jnp.zeros(())
# Drive train 1 in the tangent, drive train 2 in the secant reading of k(F).
DRIVE = mixed_drive()
LOOP = ClosedLoop(DRIVE, PreloadCascade(gains()))
_steady = eqx.filter_jit(steady_motion)


def _settled(loop, velocity, **shift):
    """State of a closed loop in steady motion at its preload."""
    state, inputs = _steady(loop.plant, loop.controller.gains.preload, velocity=jnp.asarray(velocity))
    return ClosedLoopState(state._replace(**shift), PreloadState(*inputs.command))


def _set(loop, **changes):
    for name, value in changes.items():
        loop = eqx.tree_at(lambda x, name=name: getattr(x.controller.gains, name), loop, jnp.asarray(value))
    return loop


def _half(outputs):
    return 0.5 * np.asarray(outputs.torque_1 - outputs.torque_2)


@pytest.mark.parametrize(("preload", "velocity"), [(2.5, 0.02), (-4.0, -0.1), (1.0, 0.0)])
def test_a_loop_started_in_steady_motion_stays_there(preload, velocity):
    """Up to the bend of the torque limits, 1e-6 of a torque."""
    loop = _set(LOOP, preload=preload)
    result = run(loop, Motion(velocity=velocity), TIMES, _settled(loop, velocity), STEPPING).outputs
    np.testing.assert_allclose(_half(result), preload, rtol=5e-6)
    np.testing.assert_allclose(result.table_position, velocity * TIMES, atol=2e-9)
    np.testing.assert_allclose(result.table_velocity, velocity, atol=1e-7)


@pytest.mark.parametrize("preload", [3.0, -3.0])
def test_the_preload_settles_from_loose_pinions(preload):
    loop = _set(LOOP, preload=preload)
    reference, state = Motion(velocity=0.02), loop.initial_state()
    for _ in range(6):
        result = run(loop, reference, TIMES, state, STEPPING)
        state = jax.tree.map(lambda x: x[-1], result.states)
        reference = Motion(start=reference.start + 0.2 * reference.velocity, velocity=0.02)
    assert _half(result.outputs)[-1] == pytest.approx(preload, rel=1e-5)
    assert float(result.outputs.table_velocity[-1]) == pytest.approx(0.02, rel=1e-5)


def test_the_algebraic_loop_is_solved():
    """v_p = K·(τ_p - (τ_d1 - τ_d2)/2), with the torques asked for with this v_p in them."""
    controller = PreloadCascade(gains(torque_limit=1e6, preload_gain=4e-3, acceleration_feedforward=1.5))
    state = PreloadState(jnp.asarray(3.0), jnp.asarray(-1.0))
    wanted = Motion(velocity=0.1, amplitude=1e-3)(0.013)
    start = DRIVE.initial_state()._replace(speed_1=jnp.asarray(30.0), speed_2=jnp.asarray(28.0))
    seen = DRIVE.outputs(jnp.zeros(()), start, DRIVE.rest_inputs())
    torque = controller.command(ZERO, state, wanted, seen)
    v_p = 4e-3 * (2.5 - 0.5 * (torque.motor_1 - torque.motor_2))
    common = 30.0 * (wanted.position - seen.table_position) + wanted.velocity
    ahead = 1.5 * wanted.acceleration
    expected = (
        340.0 * (common + v_p - seen.velocity_1) + 3.0 + ahead,
        340.0 * (common - v_p - seen.velocity_2) - 1.0 + ahead,
    )
    # The limit bends a torque by less than 1e-6 of it.
    np.testing.assert_allclose(torque, expected, rtol=2e-6)
    rates = controller.vector_field(ZERO, state, wanted, seen)
    errors = (common + v_p - seen.velocity_1, common - v_p - seen.velocity_2)
    np.testing.assert_allclose(rates, 340.0 / 0.02 * np.array(errors), rtol=2e-3)


def test_motors_feedback_controls_their_mean():
    table, motors = gains(), gains(feedback="motors")
    seen = DRIVE.outputs(jnp.zeros(()), DRIVE.initial_state()._replace(angle_1=jnp.asarray(1.0)), DRIVE.rest_inputs())
    wanted = Motion(start=0.01)(0.0)
    r = float(DRIVE.travel_per_radian)
    assert float(table.correction(wanted, seen)) == pytest.approx(0.3, rel=1e-12)
    assert float(motors.correction(wanted, seen)) == pytest.approx(30 * (0.01 - r / 2), rel=1e-12)


def test_the_torque_stays_within_its_limit_and_no_integral_winds_up():
    """A step of 20 mm that saturates both motors; without the limit's feedback the integrals would reach 500 Nm."""
    loop = _set(LOOP, torque_limit=6.0, preload=1.0)
    reference, state = Motion(start=0.02), _settled(loop, 0.0)
    first = run(loop, reference, TIMES, state, STEPPING)
    torques = np.stack([first.outputs.torque_1, first.outputs.torque_2])
    assert np.max(np.abs(torques)) <= 6.0
    assert np.mean(torques > 5.99) > 0.02
    assert max(float(jnp.max(jnp.abs(x))) for x in first.states.controller) < 6.5
    state = jax.tree.map(lambda x: x[-1], first.states)
    for _ in range(3):
        last = run(loop, reference, TIMES, state, STEPPING)
        state = jax.tree.map(lambda x: x[-1], last.states)
    assert float(last.outputs.table_position[-1]) == pytest.approx(0.02, abs=1e-4)
    assert np.max(first.outputs.table_position) < 0.03


@eqx.filter_jit
def _linear(loop, state, wanted):
    return linearise(loop, state, wanted, outputs=("velocity_1", "table_velocity", "torque_2"))


def test_small_motions_agree_with_the_linearised_loop():
    v, a, f = 0.02, 2e-9, 20.0
    start = _settled(LOOP, v)
    still, moved = (run(LOOP, Motion(velocity=v, amplitude=x, frequency=f), TIMES, start, STEPPING) for x in (0.0, a))
    system = _linear(LOOP, start, Motion(velocity=v)(0.0))
    omega = 2 * np.pi * f
    # The set value as 1, cos, sin: position, velocity and acceleration of a·(1 - cos ωt).
    shape = a * np.array([[1.0, -1.0, 0.0], [0.0, 0.0, omega], [0.0, omega**2, 0.0]])
    assert [name.split(".")[-1] for name in system.inputs] == ["position", "velocity", "acceleration"]
    n = system.a.shape[0]
    whole = np.zeros((n + 3, n + 3))
    whole[:n, :n], whole[:n, n:] = system.a, system.b @ shape
    whole[n + 1, n + 2], whole[n + 2, n + 1] = -omega, omega
    step, x = expm(whole * TIMES[1]), np.concatenate([np.zeros(n), [1.0, 1.0, 0.0]])
    expected = []
    for _ in TIMES:
        expected.append(system.c @ x[:n] + system.d @ shape @ x[n:])
        x = step @ x
    for name, column in zip(system.outputs, np.transpose(expected), strict=True):
        seen = np.asarray(moved.channel(name) - still.channel(name))
        np.testing.assert_allclose(seen, column, rtol=0, atol=1e-3 * np.max(np.abs(column)), err_msg=name)


def test_mirrored_motion_and_preload_give_the_mirrored_run():
    """Through changes of quadrant."""
    there = run(LOOP, Motion(0.0, 0.02, 4e-3, 6.0), TIMES, _settled(LOOP, 0.02), STEPPING)
    turned = _set(LOOP, preload=-2.5)
    back = run(turned, Motion(0.0, -0.02, -4e-3, 6.0), TIMES, negative(_settled(LOOP, 0.02)), STEPPING)
    assert np.min(there.outputs.force_1) < -50 and np.max(there.outputs.force_1) > 50
    for a, b in zip(jax.tree.leaves(there.outputs), jax.tree.leaves(back.outputs), strict=True):
        np.testing.assert_allclose(a, -b, rtol=0, atol=1e-10 * np.max(np.abs(a)))


TICKS = 400
SAMPLED = SampledLoop(DRIVE, SampledPreloadCascade(gains()), 1e-3)


def _ticks(loop, reference, state):
    return _ticks_compiled(*firm((loop, reference, state)))


@eqx.filter_jit
def _ticks_compiled(loop, reference, state):
    times = loop.period * jnp.arange(TICKS + 1)
    return simulate(loop, reference, times, initial_state=state, stepping=STEPPING)


def test_the_sampled_cascade_tends_to_the_continuous_one():
    reference, end = Motion(0.0, 0.01, 1e-3, 8.0), 0.1
    fine = run(LOOP, reference, TIMES, LOOP.initial_state(), STEPPING).outputs
    errors = []
    for count in (100, 200, 400):
        loop = eqx.tree_at(lambda x: x.period, SAMPLED, jnp.asarray(end / count))
        seen = _ticks(loop, reference, DRIVE.initial_state()).outputs
        at, every = np.arange(0, count + 1, count // 100), 200 // 100
        errors.append(np.max(np.abs(seen.table_position[at] - fine.table_position[:201:every])))
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 1, atol=0.25)


def test_the_mirrored_sampled_loop():
    start, _ = _steady(DRIVE, jnp.asarray(2.5), velocity=jnp.asarray(0.02))
    there = _ticks(SAMPLED, Motion(0.0, 0.02, 4e-3, 6.0), start).outputs
    back = _ticks(_set(SAMPLED, preload=-2.5), Motion(0.0, -0.02, -4e-3, 6.0), negative(start)).outputs
    assert np.min(there.force_1) < -50 and np.max(there.force_1) > 50
    for a, b in zip(jax.tree.leaves(there), jax.tree.leaves(back), strict=True):
        np.testing.assert_allclose(a, -b, rtol=0, atol=1e-9 * np.max(np.abs(a)))


def _closed(p):
    k1, play, d1, preload = p
    drive = both(DRIVE, lambda t: (t.mesh.stiffness.k1, t.mesh.backlash.play, t.mesh.damping.d1), k1, play, d1)
    loop = _set(eqx.tree_at(lambda x: x.plant, SAMPLED, drive), preload=preload)
    result = _ticks(loop, Motion(0.0, 0.005, 3e-3, 5.0), drive.initial_state()).outputs
    return jnp.stack([result.table_position, result.table_velocity, result.force_1, result.force_2])


@pytest.mark.slow
def test_derivatives_of_a_closed_loop_through_loss_of_contact():
    p = np.array([1.8709e7, 40e-6, 9.5376e5, 1.0])
    closed, slopes = jax.jit(_closed), jax.jit(jax.jacfwd(_closed))
    force = np.asarray(closed(p))[2:]
    for row in force:
        assert np.min(row) < -100 and np.max(row) > 100 and np.sum(np.abs(row) < 5) > 3
    exact = slopes(p)
    for i, h in enumerate(1e-5 * p):
        e = h * np.eye(p.size)[i]
        expected = (closed(p - 2 * e) - 8 * closed(p - e) + 8 * closed(p + e) - closed(p + 2 * e)) / (12 * h)
        error = np.linalg.norm(exact[..., i] - expected, axis=1) / np.linalg.norm(expected, axis=1)
        assert np.max(error) < 1e-4, (i, error)
