"""The rack-and-pinion drive in the open: steady motion, response of the table, symmetry, the table driven alone."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rack_pinion_systems import both, mixed_drive, negative, run

from twin._checks import InputError
from twin.drives import DrivenTable, DrivenTableInputs, DrivenTableState, MotorMotion, RackPinionInputs, TorquePair
from twin.drives.leipe import leipe_drive
from twin.drives.rack_pinion_operation import mesh_forces, preloaded_torques, steady_motion, table_response
from twin.laws import LuGreFriction
from twin.linear import linearise
from twin.references import SampledSignal
from twin.stepping import ConstantSteps

DRIVES = {"tangent": leipe_drive("tangent"), "secant": leipe_drive("secant"), "mixed": mixed_drive()}
MOTIONS = [(2.5, 0.0, 0.0), (2.5, 0.005, 0.0), (-6.0, -0.2, 300.0), (0.1, 0.01, -2000.0)]
TIMES = np.linspace(0.0, 0.2, 401)
FINE = ConstantSteps(8)
_steady = eqx.filter_jit(steady_motion)


@pytest.mark.parametrize("reading", DRIVES)
def test_steady_motion_is_an_equilibrium(reading):
    """Up to the bend of the torque limit, which takes less than 1e-6 of a torque this far below it."""
    drive = DRIVES[reading]
    for preload, velocity, load in MOTIONS:
        state, inputs = _steady(drive, jnp.asarray(preload), velocity=jnp.asarray(velocity), load=jnp.asarray(load))
        field = drive.vector_field(jnp.zeros(()), state, inputs)
        torque = 1e-6 * (abs(preload) + abs(load) / 377 + 1)
        for rate in (field.speed_1, field.speed_2):
            assert abs(float(rate)) < torque / float(drive.train_1.inertia)
        assert abs(float(field.table_velocity)) < 1000 * torque / float(drive.table_mass)
        r = float(drive.travel_per_radian)
        moved = [float(x) for x in (r * field.angle_1, r * field.angle_2, field.table_position)]
        np.testing.assert_allclose(moved, velocity, rtol=1e-15)
        half = 0.5 * (inputs.command.motor_1 - inputs.command.motor_2)
        assert float(half) == pytest.approx(preload, rel=1e-12)


def test_forces_add_up_to_what_the_table_needs():
    drive = DRIVES["tangent"]
    torques = preloaded_torques(drive, 3.0, velocity=0.05, load=-500.0)
    forces = mesh_forces(drive, jnp.stack(torques), 0.05)
    assert float(jnp.sum(forces)) == pytest.approx(float(drive.table_friction(0.05)) + 500.0, rel=1e-12)
    rows = mesh_forces(drive, jnp.stack(torques)[:, None] * jnp.ones(3), 0.05)
    np.testing.assert_allclose(rows, forces[:, None] * np.ones(3))


def test_laws_with_memory_have_no_steady_motion():
    memory = LuGreFriction(9.0, 13.0, 0.02, 5e4, 150.0, 100.0, 2e-3)
    drive = DRIVES["tangent"]
    with pytest.raises(InputError, match="table_friction is LuGreFriction, a law with memory"):
        steady_motion(eqx.tree_at(lambda d: d.table_friction, drive, memory), 2.5)
    with pytest.raises(InputError, match="friction of a motor is LuGreFriction"):
        steady_motion(eqx.tree_at(lambda d: d.train_2.friction, drive, memory), 2.5)
    with pytest.raises(InputError, match="table_friction"):
        table_response(eqx.tree_at(lambda d: d.table_friction, drive, memory), jnp.zeros(2), jnp.ones(1))


FREQUENCY = jnp.geomspace(0.1, 400.0, 41)


@eqx.filter_jit
def _response(drive, forces, velocity):
    return table_response(drive, forces, FREQUENCY, velocity=velocity)


@eqx.filter_jit
def _linear(drive, state, inputs):
    system = linearise(drive, state, inputs, outputs=("velocity_1", "velocity_2", "table_velocity"))
    return system.response(FREQUENCY)


@pytest.mark.parametrize(("preload", "velocity", "load"), [*MOTIONS, (0.0, 0.02, 0.0), (12.0, 1e-4, 5.0)])
def test_table_response_agrees_with_the_linearised_drive(preload, velocity, load):
    """V_T = G1·V1 + G2·V2, whichever motor is driven: two columns, two unknowns."""
    drive = DRIVES["tangent"]
    state, inputs = _steady(drive, jnp.asarray(preload), velocity=jnp.asarray(velocity), load=jnp.asarray(load))
    forces = mesh_forces(drive, jnp.stack(inputs.command), velocity)
    one, two = np.asarray(_response(drive, forces, jnp.asarray(velocity)))
    h = np.asarray(_linear(drive, state, inputs))[:, :2]
    np.testing.assert_allclose(h[2], one * h[0] + two * h[1], rtol=1e-10, atol=1e-14 * np.max(np.abs(h[2])))


def _with(p):
    k1, k2, d1, d2, d3, play, mass = p
    drive = both(DRIVES["tangent"], lambda t: (t.mesh.stiffness.k1, t.mesh.stiffness.k2), k1, k2)
    drive = both(drive, lambda t: (t.mesh.damping.d1, t.mesh.damping.d2, t.mesh.damping.d3), d1, d2, d3)
    drive = both(drive, lambda t: (t.mesh.backlash.play,), play)
    return eqx.tree_at(lambda d: d.table_mass, drive, mass)


@jax.jit
def _parts(p):
    g = table_response(_with(p), jnp.array([900.0, -850.0]), FREQUENCY, velocity=0.005)
    return jnp.stack([g.real, g.imag])


@pytest.mark.slow
def test_derivatives_of_the_table_response_agree_with_differences():
    p = np.array([1.8709e7, 5.6406, 9.5376e5, 148.3813, 2.0734e4, 40e-6, 403.8])
    exact = jax.jit(jax.jacfwd(_parts))(p)
    for i in range(p.size):
        h = 1e-4 * p[i] * np.eye(p.size)[i]
        expected = (_parts(p - 2 * h) - 8 * _parts(p - h) + 8 * _parts(p + h) - _parts(p + 2 * h)) / (1.2e-3 * p[i])
        size = np.max(np.abs(expected))
        np.testing.assert_allclose(exact[..., i], expected, rtol=1e-6, atol=1e-7 * size + 1e-9 / p[i])


def _signal(motor_1, motor_2, load):
    return SampledSignal(TIMES, RackPinionInputs(TorquePair(motor_1, motor_2), load))


# Torques that take both meshes through all four quadrants, and beyond the limit of the motors.
SIGNAL = _signal(
    2.0 + 6 * np.sin(50 * TIMES), -2.0 + 40 * np.sin(50 * TIMES + 0.4) ** 3, 400.0 * np.cos(90 * TIMES) - 100.0
)


def _start(drive):
    state, _ = _steady(drive, jnp.asarray(2.5), velocity=jnp.asarray(0.01), load=jnp.asarray(0.0))
    return state


def test_the_mirrored_input_gives_the_mirrored_motion():
    drive = DRIVES["mixed"]
    there = run(drive, SIGNAL, TIMES, _start(drive), FINE)
    mirrored = eqx.tree_at(lambda s: s.values, SIGNAL, negative(SIGNAL.values))
    back = run(drive, mirrored, TIMES, negative(_start(drive)), FINE)
    assert np.max(np.abs(there.outputs.torque_2)) <= 30.0
    for force in (there.outputs.force_1, there.outputs.force_2):
        assert np.min(force) < -100 and np.max(force) > 100
    for a, b in zip(jax.tree.leaves(there.outputs), jax.tree.leaves(back.outputs), strict=True):
        np.testing.assert_allclose(a, -b, rtol=0, atol=1e-10 * np.max(np.abs(a)))


@pytest.mark.slow
def test_the_table_alone_follows_the_motors_as_it_did_in_the_drive():
    """Up to what the motors' motion loses by being taken as straight between its samples."""
    drive = DRIVES["tangent"]
    whole = run(drive, SIGNAL, TIMES, _start(drive), FINE)
    zero_1, zero_2, x0 = 2e-3, -1e-3, 0.0
    motion = MotorMotion(
        whole.outputs.position_1 + zero_1,
        whole.outputs.velocity_1,
        whole.outputs.position_2 + zero_2,
        whole.outputs.velocity_2,
    )
    table = DrivenTable(drive, zero_1, zero_2, x0, whole.outputs.table_velocity[0])
    signal = SampledSignal(TIMES, DrivenTableInputs(motion, SIGNAL.values.load))
    alone = run(table, signal, TIMES, table.initial_state(), FINE)
    travel = np.ptp(np.asarray(whole.outputs.table_position))
    error = np.max(np.abs(alone.outputs.table_position - whole.outputs.table_position))
    assert error < 1e-4 * travel
    speed = np.max(np.abs(whole.outputs.table_velocity))
    np.testing.assert_allclose(alone.outputs.table_velocity, whole.outputs.table_velocity, atol=2e-3 * speed)
    half = 0.5 * (whole.outputs.force_1 - whole.outputs.force_2)
    np.testing.assert_allclose(alone.outputs.preload_force, half, atol=2e-2 * np.max(np.abs(half)))
    # Without the zeros of the encoders the flanks would be pressed together by 2 mm.
    wrong = run(DrivenTable(drive, 0.0, zero_2), signal, TIMES, table.initial_state(), FINE)
    assert np.max(np.abs(wrong.outputs.table_position - whole.outputs.table_position)) > 10 * error


def test_a_driven_table_needs_meshes_that_do_not_read_the_motors_torque():
    table = DrivenTable(DRIVES["mixed"])
    state = DrivenTableState(jnp.zeros(()), jnp.zeros(()), ())
    with pytest.raises(InputError, match="SecantMesh"):
        table.vector_field(jnp.zeros(()), state, table.rest_inputs())


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: leipe_drive("chord"), "reading must be"),
        (lambda: leipe_drive(play=-1e-6), "play"),
        (lambda: DrivenTable(leipe_drive(), zero_1=np.nan), "zero_1"),
        (lambda: type(DRIVES["tangent"].train_1)(0.0, *_train()[1:], 30.0), "inertia"),
        (lambda: type(DRIVES["tangent"].train_1)(*_train()[:3], 0.0), "torque_limit"),
        (lambda: type(DRIVES["tangent"])(*_drive()[:2], -1.0, *_drive()[3:]), "table_mass"),
        (lambda: type(DRIVES["tangent"])(*_drive()[:5], 0.0), "pinion_diameter"),
    ],
)
def test_bad_input_is_named(make, named):
    with pytest.raises(InputError, match=named):
        make()


def _train():
    train = DRIVES["tangent"].train_1
    return train.inertia, train.friction, train.mesh


def _drive():
    d = DRIVES["tangent"]
    return d.train_1, d.train_2, d.table_mass, d.table_friction, d.gear_ratio, d.pinion_diameter
