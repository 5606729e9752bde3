"""The table's position from the motor encoders: exact at rest, smooth, better than the mean."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rack_pinion_systems import Motion, gains, run

from twin._checks import InputError
from twin.control import ClosedLoop, PreloadCascade
from twin.control.closed_loop import ClosedLoopState
from twin.control.preload import PreloadState
from twin.control.reconstruction import mesh_forces_of_motion, reconstruct_table_position
from twin.drives.leipe import leipe_drive
from twin.drives.rack_pinion_operation import mesh_forces, steady_motion
from twin.stepping import ConstantSteps

DRIVE = leipe_drive()
_reconstruct = jax.jit(reconstruct_table_position)


def resting(forces, table=0.123):
    """Positions of both motors where these forces rest on the meshes."""
    meshes = (DRIVE.train_1.mesh, DRIVE.train_2.mesh)
    return jnp.stack([table + mesh.deflection(jnp.asarray(f)) for mesh, f in zip(meshes, forces, strict=True)])


@pytest.mark.parametrize("forces", [(900.0, -900.0), (-900.0, 900.0), (1500.0, -300.0), (-200.0, 2500.0)])
def test_exact_at_rest_in_both_quadrants_of_preload(forces):
    found = float(_reconstruct(DRIVE, resting(forces), jnp.asarray(forces)))
    assert found == pytest.approx(0.123, abs=1e-12)


def test_a_motor_that_lies_loose_in_its_play_does_not_count():
    positions = resting((2000.0, 0.0))
    for place in (-19e-6, 0.0, 19e-6):
        loose = positions.at[1].add(place)
        assert float(_reconstruct(DRIVE, loose, jnp.array([2000.0, 0.0]))) == pytest.approx(0.123, abs=1e-12)
        turned = loose[::-1]
        assert float(_reconstruct(DRIVE, turned, jnp.array([0.0, 2000.0]))) == pytest.approx(0.123, abs=1e-12)


def test_the_weights_add_up_to_one_and_pass_smoothly():
    """Read off the derivatives with respect to the positions; where both carry the same each counts half."""
    forces = jnp.stack([jnp.linspace(-2000.0, 2000.0, 81), jnp.full(81, -600.0)])
    positions = jnp.stack([jnp.full(81, 0.1), jnp.full(81, 0.1)])
    slopes = jax.jit(jax.grad(lambda x: jnp.sum(reconstruct_table_position(DRIVE, x, forces))))(positions)
    np.testing.assert_allclose(jnp.sum(slopes, axis=0), 1.0, rtol=1e-14)
    lead = np.abs(np.asarray(forces[0])) - 600.0
    np.testing.assert_allclose(slopes[0], 1 / (1 + np.exp(-lead / 100.0)), rtol=1e-10)
    assert np.all(np.asarray(slopes) >= 0)


@pytest.mark.slow
def test_through_a_loss_of_contact_derivatives_are_finite():
    """Motor 1 lets go and takes the other flank while motor 2 holds; the force passes exactly through zero."""
    way = jnp.linspace(-1.0, 1.0, 41)
    forces = jnp.stack([800.0 * way, -700.0 + 100.0 * way])

    def position(f):
        return reconstruct_table_position(DRIVE, jnp.array([0.1, 0.1 - 3e-5]), f)

    slope = np.asarray(jax.jit(jax.vmap(jax.grad(position), in_axes=1, out_axes=1))(forces))
    assert np.all(np.isfinite(slope))
    # While it is loose its deflection is not known: at a weight of e^-7 the whole play counts for 40 nm.
    sides = [float(position(jnp.array([f, -700.0]))) for f in (-1.0, 1.0)]
    assert abs(sides[1] - sides[0]) < 1e-3 * float(DRIVE.train_1.mesh.backlash.play)
    h = 1e-2
    away = [i for i in range(41) if i != 20]
    step = h * jnp.array([[1.0], [0.0]])
    difference = jax.vmap(position, 1)(forces + step) - jax.vmap(position, 1)(forces - step)
    np.testing.assert_allclose(slope[0][away], np.asarray(difference)[away] / (2 * h), rtol=1e-4, atol=1e-14)


@pytest.mark.parametrize("width", [10.0, 400.0])
def test_the_width_sets_how_far_the_weights_reach(width):
    positions, forces = jnp.array([0.1 + 1e-3, 0.1]), jnp.array([500.0, -500.0 + width])
    level = [float(x) for x in resting(forces, 0.0)]
    found = float(reconstruct_table_position(DRIVE, positions, forces, width=width))
    first = 1 / (1 + np.exp(-1.0))
    expected = first * (0.101 - level[0]) + (1 - first) * (0.1 - level[1])
    assert found == pytest.approx(expected, abs=1e-12)


@pytest.fixture(scope="module")
def moved():
    """Back and forth by 10 mm about a preload of 1.5 Nm, hard enough to lift a flank."""
    controller = PreloadCascade(gains(preload=1.5, acceleration_feedforward=9.0))
    loop = ClosedLoop(DRIVE, controller)
    state, inputs = steady_motion(DRIVE, 1.5)
    start = ClosedLoopState(state, PreloadState(*inputs.command))
    times = np.linspace(0.0, 0.5, 2001)
    reference = Motion(amplitude=5e-3, frequency=4.0)
    seen = run(loop, reference, times, start, ConstantSteps(2)).outputs
    # The reference starts with a jerk, which is left out.
    return times[400:], jax.tree.map(lambda x: x[400:], seen)


def test_better_than_the_mean_of_the_motors(moved):
    times, seen = moved
    acceleration = jnp.asarray(np.gradient(np.asarray(seen.table_velocity), times))
    torques = jnp.stack([seen.torque_1, seen.torque_2])
    observed = mesh_forces_of_motion(DRIVE, torques, seen.table_velocity, acceleration)
    true = np.asarray(seen.table_position)
    positions = jnp.stack([seen.position_1, seen.position_2])
    assert np.min(np.abs(np.asarray(seen.force_1))) < 30.0
    plain = _rms(np.mean(np.asarray(positions), axis=0) - true)
    assert _rms(np.asarray(_reconstruct(DRIVE, positions, observed)) - true) < 0.5 * plain
    forces = jnp.stack([seen.force_1, seen.force_2])
    assert _rms(np.asarray(_reconstruct(DRIVE, positions, forces)) - true) < 0.2 * plain


def _rms(values):
    return np.sqrt(np.mean(np.asarray(values) ** 2))


def test_forces_of_a_motion_are_those_through_the_meshes(moved):
    """With the measured speeds and accelerations instead of the set ones they are exact, up to differences in time."""
    times, seen = moved
    torques = jnp.stack([seen.torque_1, seen.torque_2])
    for i, (speed, force) in enumerate(((seen.velocity_1, seen.force_1), (seen.velocity_2, seen.force_2))):
        acceleration = np.gradient(np.asarray(speed), times)
        found = mesh_forces_of_motion(DRIVE, torques, speed, jnp.asarray(acceleration))[i]
        assert np.sqrt(np.mean(np.asarray(found - force) ** 2)) < 0.02 * np.max(np.abs(np.asarray(force)))


def test_forces_of_an_even_motion():
    torques = jnp.array([4.0, -2.0])
    found = mesh_forces_of_motion(DRIVE, torques, 0.1, 0.0)
    np.testing.assert_allclose(found, mesh_forces(DRIVE, torques, 0.1), rtol=1e-12)
    faster = mesh_forces_of_motion(DRIVE, torques, 0.1, 1.0)
    r = float(DRIVE.travel_per_radian)
    np.testing.assert_allclose(found - faster, float(DRIVE.train_1.inertia) / r**2, rtol=1e-12)


@pytest.mark.parametrize("width", [0.0, -1.0, float("nan")])
def test_a_width_that_is_not_positive_is_named(width):
    with pytest.raises(InputError, match="width must be"):
        reconstruct_table_position(DRIVE, jnp.zeros(2), jnp.zeros(2), width=width)
