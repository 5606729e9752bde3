import math
import os
import re

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from twin._checks import InputError
from twin.io.parameter_file import ParameterEntry, read_parameters, write_parameters

ENTRIES = (
    ParameterEntry("friction.coulomb", 20.3935, "N", 0.1012, 0.0, math.inf, "fit of the train record"),
    ParameterEntry("mass", 95.1089, "kg", source='said "about" 95'),
    ParameterEntry("mesh.stiffness.k1", 1.2345e7, "N/m", lower=1e6, upper=12.5e7),
)

numbers = st.floats(allow_nan=False)
texts = st.text(max_size=12)
names = texts.filter(str.strip)


@st.composite
def entries(draw):
    lower, upper = sorted((draw(numbers), draw(numbers)))
    errors = st.none() | st.floats(0, allow_nan=False)
    bounds = draw(st.sampled_from([(None, None), (lower, None), (None, upper), (lower, upper)]))
    return ParameterEntry(draw(names), draw(numbers), draw(names), draw(errors), *bounds, draw(texts))


def bits(entry):
    return [value.hex() if isinstance(value, float) else value for value in vars(entry).values()]


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(entries(), min_size=1, max_size=4, unique_by=lambda entry: entry.path), texts)
def test_round_trip_to_the_last_bit(tmp_path, written, header):
    path = write_parameters(tmp_path / "p.toml", written, header=header)
    assert [bits(entry) for entry in read_parameters(path)] == [bits(entry) for entry in written]


def test_layout(tmp_path):
    text = write_parameters(tmp_path / "p.toml", ENTRIES, header="EMPS\nsecond line").read_text()
    assert text.startswith("# drivetwin parameter file\n# EMPS\n# second line\n")
    assert '["friction.coulomb"]\nvalue = 20.3935\nunit = "N"\nstandard_error = 0.1012\n' in text
    assert "upper = inf\n" in text


def test_takes_numpy_numbers_and_integers(tmp_path):
    entry = ParameterEntry("mass", np.float64(0.1), "kg", lower=0)
    assert type(entry.value) is float and entry.lower == 0.0
    assert read_parameters(write_parameters(tmp_path / "p.toml", [entry])) == (entry,)


def test_every_truncation_is_noticed(tmp_path):
    path = write_parameters(tmp_path / "p.toml", ENTRIES, header="of this run")
    content = path.read_bytes()
    for kept in range(len(content) - 1):
        path.write_bytes(content[:kept])
        with pytest.raises(InputError, match=r"p\.toml"):
            read_parameters(path)


def test_written_by_hand(tmp_path):
    path = tmp_path / "hand.toml"
    path.write_bytes("\ufeff['a.b']\r\nunit = 'm'\r\nvalue = 3\r\n".encode())
    assert read_parameters(path) == (ParameterEntry("a.b", 3.0, "m"),)


@pytest.mark.parametrize(
    "text, words",
    [
        ('["a.b"]\nvalue = 1.0.0\nunit = "m"\n', ["line 2", "column", "value = 1.0.0"]),
        ('["a.b"]\nvalue =', ["value ="]),
        ('["a.b"]\nvalue = 1.0\nunit = "m', ["line 3", 'unit = "m']),
        ('["a.b"]\nvalue = 1.0\nunit = "m"\n["a.b"]\nvalue = 2.0\n', ["line 4", "a.b"]),
        ('["a.b"]\nvalue = 1.0\nvalue = 2.0\n', ["line 3", "value"]),
        (
            '["a.b"]\nvalue = 1.0\nunit = "m"\ncolour = 3\n',
            ["line 4", "'a.b'", "unknown key 'colour'", "standard_error"],
        ),
        ('[a.b]\nvalue = 1.0\nunit = "m"\n', ["line 1", '["a.b"]']),
        ('# c\n\n["a.b"]\nunit = "m"\n', ["line 3", "'a.b'", "has no value"]),
        ('["a.b"]\nvalue = 1.0\n', ["line 1", "'a.b'", "has no unit"]),
        ('["a.b"]\nvalue = nan\nunit = "m"\n', ["line 2", "value", "'a.b'", "nan"]),
        ('["a.b"]\nvalue = "1"\nunit = "m"\n', ["line 2", "value", "'1'"]),
        ('["a.b"]\nvalue = true\nunit = "m"\n', ["line 2", "value", "True"]),
        (f'["a.b"]\nvalue = 1{"0" * 400}\nunit = "m"\n', ["line 2", "value"]),
        ('["a.b"]\nvalue = 1.0\nunit = 3\n', ["line 3", "unit", "3"]),
        ('["a.b"]\nvalue = 1.0\nunit = ""\n', ["line 3", "unit", '"1"']),
        ('["a.b"]\nvalue = 1.0\nunit = "m"\nlower = 3.0\nupper = 2.0\n', ["line 4", "lower", "3.0", "2.0"]),
        ('["a.b"]\nvalue = 1.0\nunit = "m"\nstandard_error = -1.0\n', ["line 4", "standard_error", "-1.0"]),
        ('mass = 3.0\n["a.b"]\nvalue = 1.0\nunit = "m"\n', ["line 1", "'mass'", "outside"]),
        ("# nothing\n", ["holds no parameter"]),
        ("", ["empty"]),
    ],
)
def test_bad_file(tmp_path, text, words):
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_parameters(path)
    for word in ("bad.toml", *words):
        assert word in str(caught.value)


def test_file_that_is_no_text(tmp_path):
    (tmp_path / "bad.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not UTF-8"):
        read_parameters(tmp_path / "bad.toml")
    with pytest.raises(InputError, match="does not exist"):
        read_parameters(tmp_path / "gone.toml")


@pytest.mark.parametrize(
    "arguments, words",
    [
        (dict(value=math.nan), "value of parameter 'a.b'"),
        (dict(lower=math.nan), "lower of parameter"),
        (dict(lower=2.0, upper=1.0), "lower of parameter 'a.b' must not lie above upper, but is 2.0 against 1.0"),
        (dict(standard_error=-1.0), "standard_error of parameter"),
        (dict(unit=" "), "unit of parameter"),
        (dict(path=""), "path of parameter"),
    ],
)
def test_bad_entry(arguments, words):
    with pytest.raises(InputError, match=re.escape(words)):
        ParameterEntry(**{"path": "a.b", "value": 1.0, "unit": "m", **arguments})


def test_refuses_to_write(tmp_path):
    with pytest.raises(InputError, match="no parameter to write"):
        write_parameters(tmp_path / "p.toml", [])
    with pytest.raises(InputError, match="'mass' occurs twice"):
        write_parameters(tmp_path / "p.toml", [ENTRIES[1], ENTRIES[1]])
    with pytest.raises(InputError, match="folder"):
        write_parameters(tmp_path / "gone" / "p.toml", ENTRIES)
    with pytest.raises(InputError, match="UTF-8"):
        write_parameters(tmp_path / "p.toml", [ParameterEntry("a", 1.0, "m", source="\ud800")])
    assert list(tmp_path.iterdir()) == []


def test_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = write_parameters(tmp_path / "p.toml", ENTRIES)

    def fail(*_):
        raise OSError("disk full")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(OSError, match="disk full"):
        write_parameters(path, ENTRIES[:1])
    assert read_parameters(path) == ENTRIES
    assert [each.name for each in tmp_path.iterdir()] == ["p.toml"]
