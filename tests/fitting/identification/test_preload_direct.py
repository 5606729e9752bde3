"""All laws at once from responses and motions: the parts of it, and a whole fit to short synthetic evidence."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from driven_table_records import DRIVE, TRUTH, UNITS, ZEROS, record

from fitting.identification.preload_direct import (
    curve_errors,
    cut,
    fit_direct,
    motion_space,
    response_evidence,
    with_laws,
    with_zeros,
)
from fitting.identification.preload_sweep import PreloadSweep
from fitting.residuals.preloaded_response import PreloadedResponseResidual
from twin._checks import InputError
from twin.drives import DrivenTable
from twin.drives.rack_pinion_operation import table_response
from twin.frf import FRF
from twin.laws import HyperbolicDamping, RootStiffness
from twin.record import Record

FREQUENCY = jnp.linspace(40.0, 160.0, 41)
FORCES = jnp.array([[500.0, -400.0], [1000.0, -900.0], [2000.0, -1900.0], [4700.0, -4600.0]])
POINTS = np.geomspace(400.0, 4700.0, 12)
START = with_laws(DRIVE, RootStiffness(1.6e7, 5.4), HyperbolicDamping(1.5e6, 250.0, 1.8e4))


def evidence():
    one = jax.vmap(lambda f: jnp.sum(table_response(DRIVE, f, FREQUENCY, velocity=0.005), axis=0))
    values = np.asarray(jax.jit(one)(FORCES))
    variance = 1e-4 * np.abs(values) ** 2
    parts = np.random.default_rng(3).standard_normal((2, *values.shape))
    noise = np.sqrt(variance / 2) * (parts[0] + 1j * parts[1])
    return PreloadedResponseResidual(FREQUENCY, jnp.asarray(values + noise), variance, FORCES, 0.005)


def test_free_parameters_are_tied_in_both_drive_trains():
    for play, count in ((False, 9), (True, 10)):
        space = motion_space(play=play)
        assert len(space) == count
        assert ("drive.train_1.mesh.backlash.play" in space.paths) is play
        moved = space.unpack(TRUTH, jnp.asarray(space.pack(TRUTH)) + 0.1)
        one, two = moved.drive.train_1.mesh, moved.drive.train_2.mesh
        for a, b in zip(jax.tree.leaves(one), jax.tree.leaves(two), strict=True):
            assert float(a) == float(b)
        assert float(one.stiffness.k1) != float(DRIVE.train_1.mesh.stiffness.k1)
        assert (float(one.backlash.play) != 20e-6) is play


def test_with_laws_changes_both_meshes_and_nothing_else():
    for train in (START.train_1, START.train_2):
        assert float(train.mesh.stiffness.k1) == 1.6e7
        assert float(train.mesh.damping.d2) == 250.0
        assert float(train.mesh.backlash.play) == 20e-6
    assert float(START.table_mass) == float(DRIVE.table_mass)


def test_zeros_are_guessed_from_means():
    times, torques = np.arange(200) * 1e-3, (3.0, -2.6)
    channels = {"table_position": 0.02 * times}
    for i, (zero, torque) in enumerate(zip(ZEROS, torques, strict=True), start=1):
        bent = float(DRIVE.train_1.mesh.deflection(DRIVE.motor_force(torque)))
        before = times < 0.05
        channels[f"position_{i}"] = 0.02 * times + np.where(before, 1.0, bent + zero)
        channels[f"torque_{i}"] = np.where(before, 9.0, torque)
    found = with_zeros(DrivenTable(DRIVE), PreloadSweep(20.0, Record.create(times, channels, UNITS), 0.05))
    np.testing.assert_allclose([found.zero_1, found.zero_2], ZEROS, atol=1e-12)


def test_cut_takes_the_right_samples():
    times = 2.0 + np.arange(100) * 0.01
    made = Record.create(times, {"x": times}, {"x": "s"}, name="whole")
    part = cut(made, 2.3, 2.5)
    np.testing.assert_allclose(part.times, np.arange(20) * 0.01, atol=1e-12)
    np.testing.assert_allclose(part.channel("x"), 2.3 + np.arange(20) * 0.01, atol=1e-12)
    assert (part.name, part.units) == ("whole", {"x": "s"})
    with pytest.raises(InputError, match="whole has 5 samples"):
        cut(made, 2.3, 2.35)


def test_response_evidence():
    made = record(20.0)
    sweep = PreloadSweep(20.0, made, 0.0, velocity=0.007)
    values = jnp.ones((1, 1, 41)) * (1 + 2j)
    response = FRF(FREQUENCY, values, ("table",), ("motor",), variance=0.5 * jnp.ones((1, 1, 41)))
    found = response_evidence([sweep, sweep], [response, response], DRIVE)
    assert found.values.shape == (2, 41)
    assert float(found.variance[1, 7]) == 0.5
    assert float(found.velocity) == 0.007
    mean = [np.mean(np.asarray(made.channel(name))) for name in ("torque_1", "torque_2")]
    np.testing.assert_allclose(found.forces[0], np.asarray(mean) / float(DRIVE.travel_per_radian), rtol=1e-12)
    plain = FRF(FREQUENCY, values, ("table",), ("motor",))
    with pytest.raises(InputError, match="no variance"):
        response_evidence([sweep], [plain], DRIVE)
    with pytest.raises(InputError, match="1 sweeps and 2 responses"):
        response_evidence([sweep], [response, response], DRIVE)
    with pytest.raises(InputError, match="0 sweeps"):
        response_evidence([], [], DRIVE)


def test_curve_errors():
    found = with_laws(DRIVE, RootStiffness(1.1 * 1.8709e7, 5.6406), DRIVE.train_1.mesh.damping)
    stiffness, damping = curve_errors(found, DRIVE, POINTS)
    np.testing.assert_allclose(stiffness, 0.1, rtol=1e-9)
    np.testing.assert_allclose(damping, 0.0, atol=1e-15)


def test_a_direct_fit_needs_motions():
    with pytest.raises(InputError, match="no motion to fit to"):
        fit_direct(evidence(), {}, DrivenTable(START), motion_space(play=False))
