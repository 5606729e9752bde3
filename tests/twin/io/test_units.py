import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin._checks import InputError
from twin.io.units import si_unit, to_si


@pytest.mark.parametrize(
    "value, unit, expected, si, name",
    [
        (60.0, "rpm", "rad/s", 2 * np.pi, "rad/s"),
        (60.0, "1/min", "rad/s", 2 * np.pi, "rad/s"),
        (60.0, "min^-1", None, 2 * np.pi, "rad/s"),
        (60.0, "U/min", "rad/s", 2 * np.pi, "rad/s"),
        (60.0, "1/min", "Hz", 1.0, "Hz"),
        (3.0, "mm", "m", 3e-3, "m"),
        (3.0, "mm/s", "km/h", 3e-3, "m/s"),
        (180.0, "deg", "rad", np.pi, "rad"),
        (180.0, "°", None, np.pi, "rad"),
        (2.0, "bar", "Pa", 2e5, "Pa"),
        (20.0, "degC", "K", 293.15, "K"),
        (5.0, "mV", "V", 5e-3, "V"),
        (5.0, "Nm", "N m", 5.0, "N m"),
        (5.0, "mNm", None, 5e-3, "N m"),
        (1.0, "kNm/rad", None, 1e3, "N m/rad"),
        (1.0, "Nm", "N m/rad", 1.0, "N m/rad"),
        (1.0, "l/min", None, 1e-3 / 60, "m^3/s"),
        (50.0, "percent", "1", 0.5, "1"),
    ],
)
def test_converts(value, unit, expected, si, name):
    assert to_si(value, unit, expected) == pytest.approx(si, rel=1e-14)
    assert si_unit(unit, expected) == name


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(-1e6, 1e6), max_size=5))
def test_there_and_back(values):
    np.testing.assert_allclose(to_si(to_si(values, "mm") * 1e3, "mm"), np.asarray(values) * 1e-3, rtol=1e-14)


def test_wrong_dimension_says_what_is_expected():
    with pytest.raises(InputError) as caught:
        to_si([1.0], "mm", "N", name="channel 'force'")
    for words in ("channel 'force'", "'mm'", "is length", "length mass time^-2", "Give it in 'N'"):
        assert words in str(caught.value)


@pytest.mark.parametrize("unit, expected", [("Hz", "rad/s"), ("1/s", "rad/s"), ("rpm", "Hz"), ("rad/s", "Hz")])
def test_frequency_is_no_rotation(unit, expected):
    with pytest.raises(InputError, match="2 pi"):
        to_si(1.0, unit, expected)


@pytest.mark.parametrize("unit", ["", "foo", "m*", "mms", "3 m", "m//s", "__import__('os')"])
def test_unknown_unit(unit):
    with pytest.raises(InputError, match=r"channel x has the unit .* not known.*rpm"):
        to_si(1.0, unit, name="channel x")


def test_values_that_are_no_numbers():
    with pytest.raises(InputError, match="channel x must hold numbers"):
        to_si(["a"], "mm", name="channel x")


def test_heavy_libraries_are_imported_only_when_used():
    heavy = ("pint", "pandas", "pooch", "scipy.io", "tomlkit")
    rooms = ", ".join(
        f"twin.io.{room}" for room in ("csv", "data", "emps", "mat", "parameter_file", "two_inertia", "units")
    )
    code = f"import sys, {rooms}; print([name for name in {heavy!r} if name in sys.modules])"
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"
    )
