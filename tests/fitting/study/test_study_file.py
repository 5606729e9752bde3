"""Study files: tables, free parameters, errors with file, line and key."""

import pytest

from fitting.study.new_study import known_drives, new_study
from fitting.study.study_file import read_study
from twin._checks import InputError

STUDY = """
[study]
title = "axis"

[model]
type = "ServoAxis"
mass = "80 kg"
gain = "35 N/V"
friction = { type = "CoulombViscousFriction", coulomb = "10 N", viscous = "100 Ns/m", width = "1 mm/s" }

[free]
mass = { lower = "10 kg", upper = "1000 kg", scale = "log", prior = ["80 kg", "5000 g"] }
"friction.coulomb" = { lower = "0 N", upper = "0.2 kN" }
friction.viscous = { lower = "0", upper = "2 N s/mm" }
"""


def written(tmp_path, text):
    file = tmp_path / "axis.toml"
    file.write_text(text, encoding="utf-8")
    return read_study(file)


def test_free_parameters(tmp_path):
    space = written(tmp_path, STUDY).space
    assert space.paths == ("mass", "friction.coulomb", "friction.viscous")
    assert space.units == ("kg", "N", "N s/m")
    assert [p.upper for p in space.parameters] == pytest.approx([1000.0, 200.0, 2000.0])
    assert space["mass"].prior == pytest.approx((80.0, 5.0))
    assert space["mass"].scale == "log"


@pytest.mark.parametrize(
    ("old", "new", "line", "told"),
    [
        ("[study]", "[stuudy]", 2, "Did you mean 'study'"),
        ('"axis"', "7", 3, "must be text"),
        ('mass = { lower = "10 kg"', 'mass = { lower = "10 m"', 12, "mass is expected"),
        ('lower = "10 kg"', 'lower = "2000 kg"', 12, "not below the upper bound"),
        ('lower = "10 kg"', 'lower = "100 kg"', 12, "outside its bounds"),
        ('lower = "10 kg"', 'lowr = "10 kg"', 12, "Did you mean 'lower'"),
        ('"log"', '"lin"', 12, "known are"),
        ('["80 kg", "5000 g"]', '["80 kg"]', 12, "mean and a standard deviation"),
        ('["80 kg", "5000 g"]', '["80 kg", "-5 kg"]', 12, "positive standard deviation"),
        ('"friction.coulomb" =', '"friction.coulom" =', 13, "Did you mean 'friction.coulomb'"),
        ('"friction.coulomb" = { lower = "0 N", upper = "0.2 kN" }', '"friction.coulomb" = 3', 13, "must be a table"),
        ('"friction.coulomb" =', '"friction" =', None, "Cannot mutate"),
        ('upper = "0.2 kN" }', 'upper = "0.2 kN", tied = ["mass"] }', None, "twice"),
    ],
)
def test_errors_name_file_and_line(tmp_path, old, new, line, told):
    assert old in STUDY
    with pytest.raises(InputError) as error:
        assert written(tmp_path, STUDY.replace(old, new, 1)).space
    message = str(error.value)
    assert "axis.toml" in message
    assert line is None or f"line {line}," in message
    assert told in message


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"", "empty"),
        (b"\xff\xfe\x00", "not UTF-8"),
        (b"[model\n", "line 1"),
        (b"[model]\ntype = ServoAxis\n", "Text needs quotes"),
        (b"[model]\n[model]\n", "line 2"),
        (b"a = " + b"[" * 5000 + b"]" * 5000, "line"),
        (b"#" * 5_000_000, "MB"),
    ],
)
def test_what_is_no_study_file(tmp_path, content, told):
    file = tmp_path / "study.toml"
    file.write_bytes(content)
    with pytest.raises(InputError, match=told):
        read_study(file)


def test_no_free_parameters(tmp_path):
    with pytest.raises(InputError, match="no parameter is free"):
        assert written(tmp_path, STUDY.split("[free]")[0]).space


@pytest.mark.parametrize("drive", sorted(known_drives()))
def test_new_studies_can_be_read(tmp_path, drive):
    study = written(tmp_path, new_study(drive))
    assert study.model is not None
    if "free" in study.document.data:
        assert len(study.space) >= 3


def test_unknown_drive():
    with pytest.raises(InputError, match="Did you mean 'servo-axis'"):
        new_study("servo-axes")
