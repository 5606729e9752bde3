"""The -90° point of a mass driven through spring and damper: inverted exactly, and as the paper reads it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fitting.identification.peak_picking import pick_peak
from twin._checks import InputError

MASS, STIFFNESS, DAMPING = 403.8, 1.5e8, 4.3e4
LINES = np.arange(20.0, 200.0)
FINE = np.arange(80.0, 120.0, 0.005)


def response(frequency, stiffness=STIFFNESS, damping=DAMPING, mass=MASS, guides=0.0):
    s = 2j * np.pi * frequency
    return (damping * s + stiffness) / (mass * s**2 + (damping + guides) * s + stiffness)


def damping_for(ratio, stiffness=STIFFNESS, mass=MASS):
    return 2 * ratio * np.sqrt(stiffness * mass)


@pytest.mark.parametrize("guides", [0.0, 800.0])
def test_the_exact_estimator_inverts_the_curve_on_lines_of_one_hertz(guides):
    found = pick_peak(LINES, response(LINES, guides=guides), MASS, guide_damping=guides)
    assert found.stiffness == pytest.approx(STIFFNESS, rel=1e-3)
    assert found.damping == pytest.approx(DAMPING, rel=1e-3)
    assert found.damping_ratio == pytest.approx(DAMPING / (2 * np.sqrt(STIFFNESS * MASS)), rel=1e-3)


@pytest.mark.parametrize("guides", [0.0, 800.0])
def test_on_fine_lines_nothing_but_rounding_is_left(guides):
    found = pick_peak(FINE, response(FINE, guides=guides), MASS, guide_damping=guides)
    assert found.stiffness == pytest.approx(STIFFNESS, rel=1e-9)
    assert found.damping == pytest.approx(DAMPING, rel=1e-9)
    at = response(np.array([found.frequency]), guides=guides)[0]
    assert np.degrees(np.angle(at)) == pytest.approx(-90.0, abs=1e-6)
    assert abs(at) == pytest.approx(found.magnitude, rel=1e-9)


@pytest.mark.parametrize("ratio", [0.08, 0.11])
def test_as_printed_stiffness_and_damping_ratio_read_high(ratio):
    """The -90° point lies at ω₀/√(1 - 4·D²): k reads high by 1/(1 - 4·D²) = 1 + 4·D_read², D by the root of it."""
    damping = damping_for(ratio)
    found = pick_peak(FINE, response(FINE, damping=damping), MASS, estimator="paper")
    factor = 1 / (1 - 4 * ratio**2)
    assert found.frequency == pytest.approx(np.sqrt(STIFFNESS / MASS * factor) / (2 * np.pi), rel=1e-9)
    assert found.stiffness == pytest.approx(STIFFNESS * factor, rel=1e-8)
    assert found.stiffness == pytest.approx(STIFFNESS * (1 + 4 * found.damping_ratio**2), rel=1e-8)
    assert 1.026 < factor < 1.054
    assert found.damping_ratio == pytest.approx(ratio * np.sqrt(factor), rel=1e-8)
    assert found.damping == pytest.approx(damping * factor, rel=1e-8)


def test_as_printed_is_right_for_a_lag_of_second_order():
    s = 2j * np.pi * FINE
    found = pick_peak(FINE, STIFFNESS / (MASS * s**2 + DAMPING * s + STIFFNESS), MASS, estimator="paper")
    assert found.stiffness == pytest.approx(STIFFNESS, rel=1e-9)
    assert found.damping == pytest.approx(DAMPING, rel=1e-9)


def test_the_crossing_next_to_the_highest_magnitude_counts():
    """A small resonance before and behind the large one also falls through -90°."""
    weights, roots = (0.02, 1.0, 0.02), (40.0, 97.0, 160.0)
    g = sum(w * response(LINES, (2 * np.pi * f) ** 2 * MASS, 6e3) for w, f in zip(weights, roots, strict=True))
    crossings = np.count_nonzero((g.real[:-1] > 0) & (g.real[1:] <= 0) & (g.imag[:-1] < 0))
    assert crossings >= 2
    assert pick_peak(LINES, g, MASS).frequency == pytest.approx(97.0, abs=0.5)
    assert pick_peak(LINES, g, MASS, band=(130.0, 190.0)).frequency == pytest.approx(160.0, abs=2.0)


def test_few_lines_about_the_crossing_are_enough():
    part = np.array([98.3, 98.5, 98.7])
    exact = pick_peak(FINE, response(FINE), MASS)
    assert part[0] < exact.frequency < part[-1]
    assert pick_peak(part, response(part), MASS).stiffness == pytest.approx(STIFFNESS, rel=1e-3)


@settings(max_examples=60, deadline=None)
@given(
    mass=st.floats(1.0, 5e3), natural=st.floats(60.0, 140.0), ratio=st.floats(0.03, 0.2), guided=st.floats(0.0, 0.05)
)
def test_any_mass_stiffness_and_damping_are_found_again(mass, natural, ratio, guided):
    stiffness = mass * (2 * np.pi * natural) ** 2
    damping = damping_for(ratio, stiffness, mass)
    lines = np.arange(0.3, 2.0, 0.02 * ratio) * natural
    g = response(lines, stiffness, damping, mass, guided * damping)
    found = pick_peak(lines, g, mass, guide_damping=guided * damping)
    assert found.stiffness == pytest.approx(stiffness, rel=1e-4)
    assert found.damping == pytest.approx(damping, rel=1e-4)


def test_noise_is_smoothed_over_the_neighbouring_lines():
    random = np.random.default_rng(1)
    scatter = 0.02 * (random.standard_normal((200, LINES.size)) + 1j * random.standard_normal((200, LINES.size)))
    found = [pick_peak(LINES, response(LINES) + noise, MASS, band=(60.0, 140.0)).stiffness for noise in scatter]
    assert np.mean(found) == pytest.approx(STIFFNESS, rel=1e-3)
    assert np.std(found) < 3e-3 * STIFFNESS


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"band": (20.0, 60.0)}, "does not fall through -90° from 20 to 60 Hz"),
        ({"band": (500.0, 600.0)}, "between 500 and 600 Hz"),
        ({"estimator": "best"}, 'estimator must be "paper" or "exact"'),
        ({"mass": 0.0}, "mass must be positive"),
        ({"mass": float("nan")}, "mass must be finite"),
        ({"response": np.where(LINES == 90, np.nan, response(LINES))}, "NaN or infinity"),
        ({"response": 1 / response(LINES)}, "exchanged"),
        ({"response": response(LINES)[:-1]}, "two vectors of one length"),
        ({"guide_damping": float("nan")}, "guide_damping must be finite"),
        ({"frequency": LINES[::-1]}, "frequency must increase"),
    ],
)
def test_bad_input_is_named(change, message):
    given = {"frequency": LINES, "response": response(LINES), "mass": MASS, **change}
    frequency, values, mass = given.pop("frequency"), given.pop("response"), given.pop("mass")
    with pytest.raises(InputError, match=message):
        pick_peak(frequency, values, mass, **given)
