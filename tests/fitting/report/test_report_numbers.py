"""Numbers in reports: as many digits as the standard error supports."""

import math
import re

import numpy as np
import pytest
from hypothesis import given as over
from hypothesis import strategies as st

from fitting.report.numbers import given, percent, plain, together, with_error
from fitting.report.thinning import extremes


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (94.99912, 0.0191, "94.999 ± 0.019"),
        (94.99912, 0.0996, "95.00 ± 0.10"),
        (-3.00512, 0.0101, "−3.005 ± 0.010"),
        (1234.5, 67.0, "1234 ± 67"),
        (1.23456e7, 4.2e4, "(1.2346 ± 0.0042)·10⁷"),
        (7.92e-5, 1.1e-6, "(7.92 ± 0.11)·10⁻⁵"),
        (0.0, 0.5, "0.00 ± 0.50"),
        (2.0, 31.0, "2 ± 31"),
        (5.0, math.nan, "5.000"),
        (math.nan, math.nan, "–"),
    ],
)
def test_value_and_error(value, error, text):
    assert with_error(value, error) == text


def test_plain_numbers():
    assert [plain(x) for x in (0.0, 1.0, 123456.0, 1e-9, math.inf, -math.inf)] == [
        "0",
        "1.000",
        "1.235·10⁵",
        "1.000·10⁻⁹",
        "∞",
        "−∞",
    ]
    assert [given(x) for x in (10.0, 0.001, 1e7, 2.5e-6, 0.0)] == ["10", "0.001", "1·10⁷", "2.5·10⁻⁶", "0"]
    assert percent(0.0123) == "1.2 %"
    assert percent(1.5) == "150 %"
    assert together((94.96214, 95.037), 0.019, "{} … {}") == "94.962 … 95.037"


def number(text):
    mantissa, _, power = text.partition("·10")
    digits = power.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789"))
    return float(mantissa.replace("−", "-").strip("()")) * 10.0 ** int(digits or 0)


@over(st.floats(1e-12, 1e12), st.floats(1e-6, 1.0), st.sampled_from([-1.0, 1.0]))
def test_rounding_stays_within_the_error(size, relative, sign):
    """What is written differs from the value by less than a tenth of the error, and says the error to 5 %."""
    value, error = sign * size, size * relative
    text = with_error(value, error)
    inside, _, power = text.partition(")")
    first, second = re.split(" ± ", inside.strip("()"))
    assert number(first + power) == pytest.approx(value, abs=0.051 * error + 1e-12 * size)
    assert number(second + power) == pytest.approx(error, rel=0.051)


@over(st.integers(1, 40000), st.integers(1, 700), st.integers(0, 2**31))
def test_thinning_keeps_peaks_and_ends(count, pixels, seed):
    values = np.random.default_rng(seed).standard_normal(count)
    kept = extremes((values, -(values**2)), pixels)
    assert kept.size <= max(3 * pixels, 5 * pixels + 1)
    assert np.all(np.diff(kept) > 0)
    assert kept[0] == 0
    assert kept[-1] == count - 1
    for series in (values, -(values**2)):
        assert series[kept].max() == series.max()
        assert series[kept].min() == series.min()
