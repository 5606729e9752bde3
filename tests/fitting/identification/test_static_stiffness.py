"""Stiffness, play, friction and zero from a slow ramp of torque against a stop."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.identification.static_stiffness import (
    StaticDeflectionResidual,
    StaticMesh,
    identify_static_stiffness,
)
from twin._checks import InputError
from twin.drives.leipe import leipe_drive
from twin.laws import Backlash, RootStiffness, TangentMesh
from twin.record import Record

K1, K2, PLAY, FRICTION, ZERO = 1.6e7, 5.2, 30e-6, 0.18, 2.5e-4
NAMES = ("mesh.stiffness.k1", "mesh.stiffness.k2", "mesh.backlash.play", "friction", "zero")
TRUTH = (K1, K2, PLAY, FRICTION, ZERO)
DRIVE = leipe_drive()
MESH = TangentMesh(RootStiffness(K1, K2), DRIVE.train_1.mesh.damping, Backlash(PLAY))
STATIC = StaticMesh(MESH, FRICTION, ZERO, DRIVE.travel_per_radian)
_deflection = eqx.filter_jit(STATIC.deflection)


def ramp(motor=1, noise=1e-7, corners=(0.0, 10.0, 0.0, -10.0, 0.0), samples=4000):
    """What an ideal stand records: both turns, friction against the way, noise."""
    part = np.arange(samples) / samples
    torque = np.interp(part, np.linspace(0, 1, len(corners)), corners)
    direction = np.sign(np.gradient(torque))
    apart = np.asarray(_deflection(torque, direction))
    random = np.random.default_rng(4)
    table = 1e-6 * torque
    channels = {
        f"position_{motor}": apart + table + noise * random.standard_normal(samples),
        "table_position": table,
        f"torque_{motor}": torque,
    }
    units = {f"position_{motor}": "m", "table_position": "m", f"torque_{motor}": "N m"}
    return Record.create(6.0 * part, channels, units, name="a ramp")


@pytest.fixture(scope="module")
def found():
    return identify_static_stiffness(ramp(), DRIVE, least_torque=0.5, deviation=3e-8)


def test_the_truth_lies_within_the_intervals(found):
    assert found.success
    for truth, (low, high), name in zip(TRUTH, found.intervals(0.999), NAMES, strict=True):
        assert low < truth < high, name
    np.testing.assert_allclose(found.values, TRUTH, rtol=2e-2)
    assert found.rms == pytest.approx(1.0, abs=0.2)


def test_without_noise_the_truth_comes_back():
    found = identify_static_stiffness(ramp(noise=0.0), DRIVE, least_torque=0.5)
    np.testing.assert_allclose(found.values, TRUTH, rtol=5e-3)


def test_motor_2_uses_its_own_mesh_and_channels(found):
    """Started from a mesh so loose that its own start would not do."""
    other = dataclasses.replace(DRIVE, train_1=dataclasses.replace(DRIVE.train_1, mesh=eqx.tree_at(_play, MESH, 1e-2)))
    second = identify_static_stiffness(ramp(2), other, motor=2, least_torque=0.5, deviation=3e-8)
    np.testing.assert_allclose(second.values, found.values, rtol=1e-6)
    with pytest.raises(InputError, match="no channel 'torque_1'"):
        identify_static_stiffness(ramp(2), DRIVE, least_torque=0.5)


def _play(mesh):
    return mesh.backlash.play


def test_the_model_is_the_static_mesh():
    torque, direction = np.array([-5.0, 3.0, 3.0]), np.array([-1.0, 1.0, -1.0])
    forces = (torque - FRICTION * direction) / float(DRIVE.travel_per_radian)
    expected = [ZERO + float(MESH.deflection(force)) for force in forces]
    np.testing.assert_allclose(STATIC.deflection(torque, direction), expected, rtol=1e-12)
    evidence = StaticDeflectionResidual(torque, direction, np.asarray(expected) - 2e-7, 1e-7)
    np.testing.assert_allclose(evidence(STATIC), 2.0, rtol=1e-6)


def test_what_lies_within_the_least_torque_is_left_out():
    """Near zero torque a pinion may lie anywhere in its play."""
    record = ramp()
    loose = np.abs(np.asarray(record.channel("torque_1"))) < 0.4
    moved = jnp.where(loose, 0.5, record.channel("position_1"))
    spoilt = record.with_channel("position_1", moved, "m")
    found = identify_static_stiffness(spoilt, DRIVE, least_torque=0.5, deviation=3e-8)
    np.testing.assert_allclose(found.values, TRUTH, rtol=2e-2)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"motor": 3}, "motor must be 1 or 2, but is 3"),
        ({"least_torque": 0.0}, "least_torque must be positive"),
        ({"least_torque": -1.0}, "least_torque must be positive"),
        ({"deviation": 0.0}, "deviation must be positive"),
        ({"points": 0}, "points must be at least 8"),
        ({"least_torque": 20.0}, "a ramp has 0 points above 20 Nm"),
        ({"record": ramp(corners=(0.0, 10.0, 0.0))}, "on one side only"),
        ({"motor": 2}, "no channel 'torque_2'"),
    ],
)
def test_bad_input_is_named(change, message):
    options = {"record": ramp(), "least_torque": 0.5, **change}
    with pytest.raises(InputError, match=message):
        identify_static_stiffness(options.pop("record"), DRIVE, **options)
