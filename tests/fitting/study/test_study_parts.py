"""Parts of a study's way from file to evidence: noise read from a record, numbers that a record begins with, modes."""

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.demo import demo_axis, demo_reference, make_record
from fitting.residuals.set_leaves import WithLeaves
from fitting.residuals.trajectory import TrajectoryResidual
from fitting.study.limits import limit_warnings
from fitting.study.model_modes import OperatingPoint, elastic_modes, linear_model
from fitting.study.noise import noise_deviation
from fitting.study.outputs import KNOWN, parse_outputs
from fitting.study.study_file import read_study
from fitting.study.written import write_fitted
from twin._checks import InputError
from twin.drives import TwoMass, leipe_drive, mauro_axis
from twin.laws import CoulombViscousFriction, LuGreFriction, ViscousFriction
from twin.modal import modes
from twin.paths import get_leaf, set_leaves
from twin.record import Record


@pytest.mark.parametrize("deviation", [1e-6, 1e-3])
def test_noise_on_a_smooth_channel(deviation):
    times = np.arange(5000) * 1e-3
    values = 0.1 * np.sin(2 * np.pi * times) + deviation * np.random.default_rng(1).standard_normal(times.size)
    assert noise_deviation(values) == pytest.approx(deviation, rel=0.1)


def test_a_few_jumps_are_no_noise():
    values = 1e-3 * np.random.default_rng(1).standard_normal(5000)
    values[::500] += 1.0
    assert noise_deviation(values) == pytest.approx(1e-3, rel=0.1)


def test_rounding_is_noise():
    values = np.round(np.linspace(0, 1, 5000), 2)
    assert noise_deviation(values) == pytest.approx(0.01 / np.sqrt(12), rel=1e-6)
    assert noise_deviation(np.zeros(100)) > 0


def test_a_record_begins_where_it_says():
    loop, reference = demo_axis(), demo_reference()
    record = make_record(loop, reference).slice(0.0, 0.3)
    plain = TrajectoryResidual.create(record, reference, {"position": 1e-6})
    moved = set_leaves(loop, {"plant.initial_position": 0.01})
    part = WithLeaves(plain, (jnp.asarray(0.01),), ("plant.initial_position",))
    np.testing.assert_array_equal(part(loop), plain(moved))
    assert float(jnp.max(jnp.abs(part(loop) - plain(loop)))) > 1.0


def test_modes_are_those_of_the_mechanics():
    axis = mauro_axis()
    exact = np.asarray(modes(axis.second_order()).frequency)[1:]
    found = np.asarray(elastic_modes(axis).frequency)
    np.testing.assert_allclose(found[: exact.size - 1], exact[:-1], rtol=0.05)
    assert np.isnan(found[-1])


def test_friction_counts_as_in_motion():
    sharp = TwoMass(2e-3, 3e-3, 100.0, 0.02, CoulombViscousFriction(0.5, 5e-3, 1e-3), ViscousFriction(2e-3))
    smooth = TwoMass(2e-3, 3e-3, 100.0, 0.02, ViscousFriction(5e-3), ViscousFriction(2e-3))
    bristles = TwoMass(
        2e-3, 3e-3, 100.0, 0.02, LuGreFriction(0.5, 0.6, 0.1, 100.0, 0.1, 5e-3, 1e-3), ViscousFriction(2e-3)
    )
    for drive in (sharp, bristles):
        np.testing.assert_allclose(np.asarray(elastic_modes(drive)), np.asarray(elastic_modes(smooth)), rtol=1e-6)
    blocked = elastic_modes(sharp, OperatingPoint(speed=0.0))
    assert float(blocked.frequency[0]) != pytest.approx(float(elastic_modes(smooth).frequency[0]), rel=0.1)


def test_preload_stiffens():
    low, high = (elastic_modes(leipe_drive(), OperatingPoint(0.005, preload)) for preload in (1.0, 10.0))
    assert float(high.frequency[0]) > 1.1 * float(low.frequency[0])


def test_what_has_no_modes():
    with pytest.raises(InputError, match="is no drive"):
        linear_model(ViscousFriction(1.0))


def test_outputs():
    assert parse_outputs(["max(x)", " rms_error( x ) ", "frequency(2)"], ("x",), ("x",)) == (
        ("max", "x"),
        ("rms_error", "x"),
        ("frequency", "2"),
    )
    assert len(set(KNOWN)) == len(KNOWN)
    for bad in ("max", "max()", "max(y)", "rms_error(y)", "damping(0)", "damping(x)", "__import__(os)"):
        with pytest.raises(InputError):
            parse_outputs([bad], ("x", "y"), ("x",)) if bad != "max(y)" else parse_outputs([bad], ("x",), ("x",))


def test_fitted_values_go_where_the_file_has_them(tmp_path):
    text = """
[model]
type = "ServoAxis"
mass = "0.08 t"  # weighed
friction = { type = "ViscousFriction", viscous = "100 N s/m" }
[free]
mass = { lower = "10 kg", upper = "100 kg" }
"friction.viscous" = { lower = "1 N s/m", upper = "200 N s/m" }
offset = { lower = "-5 N", upper = "5 N" }
"""
    (tmp_path / "axis.toml").write_text(text)
    study = read_study(tmp_path / "axis.toml")
    values = {"mass": 81.25, "friction.viscous": 90.125, "offset": 1.5}
    file = write_fitted(study, tmp_path, study.space, values)
    again = read_study(file).model
    for path, value in values.items():
        assert float(get_leaf(again, path)) == value
    assert "# weighed" in file.read_text()


@pytest.mark.parametrize(("largest", "told"), [(9.9, 0), (10.2, 0), (27.0, 1)])
def test_a_command_beyond_the_limit_is_told(largest, told):
    command = largest * np.sin(np.linspace(0.0, 7.0, 200))
    record = Record.create(1e-3 * np.arange(200), {"command": command}, {"command": "A"})
    found = limit_warnings(demo_axis(), record, "run1")
    assert len(found) == told
    assert limit_warnings(demo_axis().plant, record, "run1") == ()
    if told:
        assert "reaches 27 A, the model cuts at 10 A" in found[0]
