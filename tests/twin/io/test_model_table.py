"""Models from TOML and back, and errors that name file, line and key."""

import equinox as eqx
import numpy as np
import pytest

from fitting.demo import demo_axis
from twin._checks import InputError
from twin.control import ClosedLoop, DelayedPlant, PositionVelocityPI
from twin.drives import ServoAxis, TwoMass, leipe_drive, mauro_axis
from twin.io.class_fields import facts_of, summary_of
from twin.io.model_table import build_model
from twin.io.model_text import model_text
from twin.io.model_types import known_types, type_named, unit_of_leaf
from twin.io.toml_document import TomlDocument
from twin.laws import (
    AbstractFriction,
    CoulombFriction,
    CoulombViscousFriction,
    HarmonicForce,
    SumFriction,
    ViscousFriction,
)

AXIS = """
[model]
type = "SampledLoop"
period = "1 ms"

[model.plant]
type = "servo axis"
mass = "80 kg"
gain = "35 N/V"
friction = { type = "CoulombViscousFriction", coulomb = "10 N", viscous = "100 Ns/m", width = "1 mm/s" }

[model.controller]
type = "SampledPositionVelocity"
position_gain = "160 1/s"
velocity_gain = 240
"""


def two_mass():
    return TwoMass(
        1.0,
        2.0,
        1e4,
        1.0,
        CoulombViscousFriction(5.0, 0.1, 1e-3),
        SumFriction((ViscousFriction(0.1), CoulombFriction(1.0, 0.1))),
        1.0,
    )


def written(tmp_path, text):
    file = tmp_path / "study.toml"
    file.write_text(text, encoding="utf-8")
    return TomlDocument(file)


MODELS = {
    "sampled axis": demo_axis,
    "rack and pinion": leipe_drive,
    "ball screw": mauro_axis,
    "two masses, sum of frictions": two_mass,
    "delayed": lambda: DelayedPlant(two_mass(), 1e-4),
    "rotary axis": lambda: ServoAxis(
        0.01, ViscousFriction(0.1), position_force=HarmonicForce(1.0, [0.1, 0.2], [0.0, 0.3])
    ),
    "closed loop": lambda: ClosedLoop(mauro_axis(), PositionVelocityPI(45.0, 1.0, 30.0, 0.01, voltage_limit=300.0)),
}


@pytest.mark.parametrize("name", MODELS)
def test_what_is_written_is_read_again(tmp_path, name):
    model = MODELS[name]()
    for rotary in (None, True, False):
        again = build_model(written(tmp_path, model_text(model, rotary=rotary)))
        assert eqx.tree_equal(again, model, rtol=1e-14)


def test_units_are_converted(tmp_path):
    loop = build_model(written(tmp_path, AXIS.replace('"80 kg"', '"0.08 t"').replace('"1 ms"', '"1000 us"')))
    assert float(loop.plant.mass) == pytest.approx(80.0, rel=1e-15)
    assert float(loop.period) == pytest.approx(1e-3, rel=1e-15)
    assert float(loop.plant.friction.width) == pytest.approx(1e-3, rel=1e-15)


def test_like_takes_over_and_changes(tmp_path):
    text = model_text(leipe_drive()).replace('train_2 = { like = "train_1" }', "")
    text = text.replace(
        "\n[model.train_1]", '\n[model.train_2]\nlike = "train_1"\ntorque_limit = "20 N m"\n\n[model.train_1]'
    )
    drive = build_model(written(tmp_path, text))
    assert float(drive.train_2.torque_limit) == 20.0
    assert eqx.tree_equal(drive.train_2.mesh, drive.train_1.mesh) is True or bool(
        eqx.tree_equal(drive.train_2.mesh, drive.train_1.mesh)
    )


def test_set_changes_numbers_below(tmp_path):
    document = written(tmp_path, '[model]\ntype = "mauro_axis"\nset = { "springs.support" = "500 N/um" }\n')
    assert float(build_model(document).springs.support) == pytest.approx(5e8)


def test_vectors_with_one_unit(tmp_path):
    text = """
[model]
type = "HarmonicForce"
wave_number = "100 rad/m"
cosine = { values = [1.0, 2.0], unit = "N" }
sine = ["3 N", "0.004 kN"]
"""
    names = list(facts_of(HarmonicForce))
    text = text.replace("wave_number", names[0]).replace("cosine", names[1]).replace("sine =", f"{names[2]} =")
    if "period" in names[0]:
        text = text.replace("100 rad/m", "10 mm")
    force = build_model(written(tmp_path, text))
    np.testing.assert_allclose(np.asarray(getattr(force, names[1])), [1.0, 2.0])
    np.testing.assert_allclose(np.asarray(getattr(force, names[2])), [3.0, 4.0])


BAD = [
    ('"80 kg"', '"80 m"', 8, "model.plant.mass", "mass is expected"),
    ('"80 kg"', "80", 8, "model.plant.mass", "has no unit"),
    ('"80 kg"', '"eighty"', 8, "model.plant.mass", "must be a number with its unit"),
    ('"80 kg"', '"80,5 kg"', 8, "model.plant.mass", "decimal point"),
    ('"80 kg"', "true", 8, "model.plant.mass", "must be a quantity"),
    ('"80 kg"', '"nan kg"', 8, "model.plant.mass", "must be a number"),
    ('"80 kg"', '"-80 kg"', 6, "model.plant", "must be positive"),
    ('"80 kg"', "[1, 2]", 8, "model.plant.mass.0", "no unit"),
    ('"80 kg"', '{ type = "ServoAxis" }', 8, "model.plant.mass", ""),
    ('mass = "80 kg"', "", 6, "model.plant", "needs the key 'mass'"),
    ("servo axis", "servo axes", 7, "model.plant.type", "Did you mean 'ServoAxis'"),
    ("mass =", "maas =", 8, "model.plant.maas", "Did you mean 'mass'"),
    ('"servo axis"', "3", 7, "model.plant.type", "must be the name of a type"),
    ('{ type = "Coulomb', '{ type = "Rot", kind = "Coulomb', 10, "model.plant.friction.type", "not known"),
    ('{ type = "CoulombViscousFriction", ', "{ ", 10, "model.plant.friction", "needs a type"),
    (
        '{ type = "CoulombViscousFriction", ',
        '{ type = "RootStiffness", ',
        10,
        "model.plant.friction.type",
        "does not go here",
    ),
    ('coulomb = "10 N"', 'coulomb = "-10 N"', 10, "model.plant.friction", "must not be negative"),
    ('"1 ms"', '"1 kg"', 4, "model.period", "time is expected"),
    ('"35 N/V"', '"35 N/Q"', 9, "model.plant.gain", "not known"),
    ("[model.controller]", "[model.controler]", 12, "model.controler", "not known"),
    ("[model.plant]", '[model.plant]\nlike = "motor"', 7, "model.plant.like", "no table 'motor'"),
    (
        'period = "1 ms"',
        'period = "1 ms"\nset = { "plant.mas" = "1 kg" }',
        5,
        'model.set."plant.mas"',
        "no 'mas' there",
    ),
    (
        'period = "1 ms"',
        'period = "1 ms"\nset = { "plant.mass" = "1 m" }',
        5,
        'model.set."plant.mass"',
        "mass is expected",
    ),
    ('period = "1 ms"', 'period = "1 ms"\nset = { "plant.mass" = "-1 kg" }', 5, "model.set", "must be positive"),
    ('period = "1 ms"', 'period = "1 ms"\nset = 3', 5, "model.set", "must be a table"),
]


@pytest.mark.parametrize(("old", "new", "line", "key", "told"), BAD)
def test_errors_name_file_line_and_key(tmp_path, old, new, line, key, told):
    assert old in AXIS
    with pytest.raises(InputError) as error:
        build_model(written(tmp_path, AXIS.replace(old, new, 1)))
    message = str(error.value)
    assert str(tmp_path / "study.toml") in message
    assert f"line {line}, key {key}:" in message
    assert told in message


def test_circle_of_likes(tmp_path):
    text = AXIS.replace("friction = {", 'friction = { like = "plant.friction", ').replace(
        'type = "CoulombViscousFriction", ', ""
    )
    with pytest.raises(InputError, match=r"circle|needs a type"):
        build_model(written(tmp_path, text))


def test_missing_model(tmp_path):
    with pytest.raises(InputError, match=r"the table \[model\] is missing"):
        build_model(written(tmp_path, "[study]\n"))


def test_every_type_can_be_named_and_says_what_it_is():
    for name, made in known_types().items():
        assert type_named(name) is made
        assert callable(type_named(name.lower().replace("_", " ")))
        assert summary_of(made), name
    assert "CoulombViscousFriction" in known_types()
    assert "AbstractFriction" not in known_types()
    assert type_named("coulomb-viscous friction", AbstractFriction) is CoulombViscousFriction


def test_units_of_leaves():
    axis = demo_axis()
    assert unit_of_leaf(axis, "plant.mass") == ("kg", "kg m²")
    assert unit_of_leaf(axis, "plant.gain") is None
    assert unit_of_leaf(leipe_drive(), "train_1.mesh.stiffness.k2") == ("1",)
