"""Numbers with units as text."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from twin._checks import InputError
from twin.io.quantity import parse_quantity
from twin.io.units import to_si

GOOD = [
    ("80 kg", ("kg", "kg m²"), 80.0, "kg"),
    ("3 kg cm^2", ("kg", "kg m²"), 3e-4, "kg m^2"),
    ("35 N/V", None, 35.0, "N/V"),
    ("100 Ns/m", ("Ns/m", "Nms/rad"), 100.0, "N s/m"),
    ("0.1 Nms/rad", ("Ns/m", "Nms/rad"), 0.1, "N m s/rad"),
    ("5 %", ("1",), 0.05, "1"),
    (3, ("1",), 3.0, "1"),
    ("160 1/s", ("1/s",), 160.0, "1/s"),
    ("9.5e5 N²s/m", ("N²s/m",), 9.5e5, "N^2 s/m"),
    ("2 Ohm", ("Ohm",), 2.0, "ohm"),
    ("3000 1/min", ("m/s", "rad/s"), 100 * math.pi, "rad/s"),
    ("0", ("kg",), 0.0, "kg"),
    ("inf", ("N",), math.inf, "N"),
    ("-1.5e-3m", ("m",), -1.5e-3, "m"),
    ("1_000 mm", ("m",), 1.0, "m"),
]


@pytest.mark.parametrize(("written", "units", "value", "unit"), GOOD)
def test_known_answers(written, units, value, unit):
    found = parse_quantity(written, units)
    assert found.value == pytest.approx(value, rel=1e-14)
    assert found.unit == unit


@pytest.mark.parametrize(
    ("written", "units", "told"),
    [
        ("80", ("kg",), "has no unit"),
        (80, ("kg",), "has no unit"),
        ("80 kg", ("m",), "length is expected"),
        ("0,5 mm", ("m",), "decimal point"),
        ("abc", None, "must be a number"),
        ("", None, "must be a number"),
        (True, None, "must be a quantity"),
        ([1], None, "must be a quantity"),
        ("5 kgg", None, "not known"),
        ("5 50 N", ("N",), "not known|is expected"),
        ("5 __import__('os')", None, "not known"),
    ],
)
def test_what_is_no_quantity(written, units, told):
    with pytest.raises(InputError, match=told):
        parse_quantity(written, units, name="mass")


@given(st.text(max_size=30))
def test_any_text_is_a_quantity_or_one_error(text):
    try:
        found = parse_quantity(text)
    except InputError:
        return
    assert isinstance(found.value, float)


@given(st.floats(1e-6, 1e6), st.sampled_from(["mm", "um", "m", "inch"]))
def test_the_same_as_conversion(value, unit):
    assert parse_quantity(f"{value!r} {unit}", ("m",)).value == pytest.approx(float(to_si(value, unit, "m")), rel=1e-14)


def test_products_of_newton_metres_stay_together():
    assert float(to_si(1.0, "rad/Nm")) == 1.0
    assert parse_quantity("1 1/Nms").value == 1.0
    assert parse_quantity("1 mNm").value == pytest.approx(1e-3)
