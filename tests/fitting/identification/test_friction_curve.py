"""Friction over speed: a known law comes back within its error bars from noisy records, and bad records do not pass."""

import jax.numpy as jnp
import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jaxtyping import TypeCheckError
from scipy.signal import lfilter

from fitting.identification.friction_curve import friction_curve
from fitting.identification.friction_fit import fit_stribeck
from fitting.plots_friction import plot_friction_curve
from twin._checks import InputError
from twin.laws import StribeckFriction
from twin.record import Record

matplotlib.use("Agg")

LAW = StribeckFriction(1.2, 2.0, 8.0, 0.008, 0.05)
K_T = 0.7
SPEEDS = np.array([1.0, 2.0, 4.0, 7.0, 12.0, 20.0, 40.0, 80.0, 140.0, 200.0])
BOTH = np.concatenate([-SPEEDS[::-1], SPEEDS])
MEMORY = 0.9


def record(speed, seed, *, law=LAW, noise=0.3, load=0.0, samples=2000):
    """One constant motion; the current's noise hangs together over some ten samples."""
    rng = np.random.default_rng(seed)
    white = rng.standard_normal((2, samples))
    coloured = lfilter([np.sqrt(1 - MEMORY**2)], [1, -MEMORY], white[0])
    velocity = speed + 0.02 * abs(speed) * white[1]
    current = (float(law(speed)) + load) / K_T + noise * coloured
    units = {"velocity": "rad/s", "current": "A"}
    return Record.create(
        np.arange(samples) * 1e-3, {"velocity": velocity, "current": current}, units, name=f"{speed:g}"
    )


def records(seed, **options):
    return [record(speed, (seed, i), **options) for i, speed in enumerate(BOTH)]


@pytest.fixture(scope="module")
def curve():
    return friction_curve(records(0), K_T)


def test_standard_errors_cover_the_truth(curve):
    off = (curve.torques - np.asarray(LAW(curve.speeds))) / curve.standard_errors
    assert np.all(np.abs(off) < 4)
    # Independent samples would claim a quarter of this: the correlation time is (1 + 0.9)/(1 - 0.9) = 19 samples.
    expected = K_T * 0.3 * np.sqrt((1 + MEMORY) / (1 - MEMORY) / 2000)
    assert np.median(curve.standard_errors) == pytest.approx(expected, rel=0.3)
    wide = np.concatenate([friction_curve(records(seed), K_T).torques - np.asarray(LAW(BOTH)) for seed in range(1, 6)])
    assert np.std(wide) == pytest.approx(expected, rel=0.25)


def test_stribeck_law_comes_back_within_its_error_bars(curve):
    found = curve.stribeck(width=0.05)
    assert found.success, found.message
    for path in found.space.paths:
        estimate = found[path]
        assert abs(estimate.value - float(getattr(LAW, path))) < 4 * estimate.standard_error, path
        assert estimate.standard_error < 0.5 * estimate.value
    assert 0.4 < found.rms < 1.8


def test_exact_points_give_the_exact_law():
    found = fit_stribeck(BOTH, np.asarray(LAW(BOTH)), np.zeros(BOTH.size), width=0.05)
    np.testing.assert_allclose(found.values, [1.2, 2.0, 8.0, 0.008], rtol=1e-6)


def test_no_fall_is_said():
    """A broad Stribeck curve would fit this well, as a bend of friction that only rises."""
    rising = fit_stribeck(SPEEDS, 1 + 0.01 * SPEEDS - 0.3 * np.exp(-SPEEDS / 5), np.full(SPEEDS.size, 0.01))
    assert "no fall" in rising.message
    assert float(rising.model.static) == float(rising.model.coulomb)


def test_table_goes_through_the_points_and_turns_within_its_width(curve):
    law = curve.tabulated(width=0.1)
    np.testing.assert_allclose(law(curve.speeds), curve.torques, rtol=1e-12)
    lowest = curve.torques[curve.speeds > 0][0]
    assert float(law(0.1)) == pytest.approx(lowest, rel=1e-12)
    assert abs(float(law(0.0))) < 0.05
    grid = np.linspace(-0.1, 0.1, 101)
    assert np.all(np.diff(law(grid)) > 0)
    with pytest.raises(InputError, match="lowest measured speed"):
        curve.tabulated(width=1.5)
    with pytest.raises(InputError, match="width"):
        curve.tabulated(width=0.0)


def test_mean_of_directions_takes_a_weight_out():
    loaded = friction_curve(records(2, load=0.8), K_T)
    assert abs(float(np.mean(loaded.torques)) - 0.8) < 0.05
    folded = friction_curve(records(2, load=0.8), K_T, mean_of_directions=True)
    np.testing.assert_allclose(folded.speeds, SPEEDS, rtol=1e-2)
    assert np.all(np.abs(folded.torques - np.asarray(LAW(folded.speeds))) < 4 * folded.standard_errors)
    assert np.all(folded.records == 2)
    # The mirror image is the other direction.
    law = folded.tabulated(width=0.1)
    np.testing.assert_allclose(law(-folded.speeds), -folded.torques, rtol=1e-12)
    some = friction_curve([*records(2), record(300.0, 3)], K_T, mean_of_directions=True)
    assert some.speeds.size == SPEEDS.size and "one direction" in some.rejected[0]
    with pytest.raises(InputError, match="both directions"):
        friction_curve([record(3.0, 0)], K_T, mean_of_directions=True)


def test_repeated_speeds_are_merged_and_their_scatter_counts():
    same = friction_curve([record(12.0, i) for i in range(9)], K_T)
    assert same.speeds.size == 1 and same.records[0] == 9
    single = friction_curve([record(12.0, 0)], K_T)
    assert same.standard_errors[0] < 0.6 * single.standard_errors[0]
    warm = friction_curve([record(12.0, i, load=0.2 * i) for i in range(4)], K_T)
    assert warm.standard_errors[0] > 3 * same.standard_errors[0]
    assert friction_curve([record(12.0, 0), record(-12.0, 1), record(12.5, 2)], K_T).speeds.size == 3


@given(st.floats(0.5, 300.0), st.floats(-3.0, 3.0))
@settings(max_examples=20, deadline=None)
def test_pairs_without_noise_are_exact(speed, ampere):
    found = friction_curve([(speed, np.full(64, ampere)), (-speed, np.full(64, -ampere))], K_T)
    np.testing.assert_allclose(found.torques, [-K_T * ampere, K_T * ampere], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.standard_errors, 0.0, atol=1e-14)


T = np.arange(2000) * 1e-3
RAMP, FLAT = np.linspace(5.0, 6.0, 2000), np.ones(2000)


@pytest.mark.parametrize(
    ("bad", "named"),
    [
        ((RAMP, FLAT), "part [18] of 8"),
        ((10 + np.where(T > 1.5, 5.0, 0.0), FLAT), "part 7|part 8"),
        ((np.zeros(2000), FLAT), "standstill"),
        ((np.random.default_rng(0).standard_normal(2000), FLAT), "standstill"),
        ((np.sin(2 * np.pi * 0.7 * T) + 1.2, FLAT), "constant speed"),
    ],
)
def test_motion_that_is_not_constant_is_refused_or_marked(bad, named):
    with pytest.raises(InputError, match=named):
        friction_curve([(3.0, FLAT), bad], K_T)
    left = friction_curve([(3.0, FLAT), bad], K_T, skip=True)
    assert left.speeds.size == 1 and "Record 1 was left out" in left.rejected[0]
    assert "left out" in left._repr_html_()
    with pytest.raises(InputError, match="no record"):
        friction_curve([bad], K_T, skip=True)


def test_noise_alone_is_no_fault():
    for seed in range(20):
        speed = 5 + np.random.default_rng(seed).standard_normal(4000)
        assert friction_curve([(speed, np.ones(4000))], K_T).speeds.size == 1


@pytest.mark.parametrize(
    ("bad", "named"),
    [
        ((5.0, np.ones(4)), "at least 16"),
        ((np.ones(10), np.ones(20)), "shape"),
        ((5.0, np.array([np.nan] * 20)), "NaN"),
        ((5.0, 3.0, 2.0), "pair|type-check|Type-check"),
        (Record.create(T, {"velocity": RAMP, "current": FLAT}, {"velocity": "m/s", "current": "A"}), "rad/s"),
        (Record.create(T, {"speed": RAMP}, {"speed": "rad/s"}), "velocity"),
    ],
)
def test_bad_records_are_named(bad, named):
    with pytest.raises((InputError, TypeCheckError), match=named):
        friction_curve([bad], K_T)


def test_bad_options_are_named(curve):
    with pytest.raises(InputError, match="torque_constant"):
        friction_curve(records(0), 0.0)
    with pytest.raises(InputError, match="no record"):
        friction_curve([], K_T)
    with pytest.raises(InputError, match="merge"):
        friction_curve(records(0), K_T, merge=1.5)
    with pytest.raises(InputError, match="four"):
        fit_stribeck(SPEEDS[:3], SPEEDS[:3], SPEEDS[:3])
    with pytest.raises(InputError, match="zero"):
        fit_stribeck(np.arange(5.0), np.ones(5), np.ones(5))


def test_table_and_picture(curve):
    table = curve.to_dataframe()
    assert list(table.columns)[1:4] == ["speed [1/min]", "friction torque [N m]", "standard error [N m]"]
    np.testing.assert_allclose(table["speed [1/min]"], curve.speeds * 60 / (2 * np.pi))
    given = plt.subplots()[1]
    for ax in (None, given):
        drawn = plot_friction_curve(curve, {"table": curve.tabulated(width=0.1), "Stribeck": LAW}, ax=ax)
        assert drawn.get_xlabel() == "speed [1/min]" and drawn.get_ylabel() == "friction torque [N m]"
        assert [t.get_text() for t in drawn.get_legend().get_texts()][:2] == ["table", "Stribeck"]
        (line, *_rest) = drawn.lines
        np.testing.assert_allclose(
            line.get_ydata(), curve.tabulated(width=0.1)(jnp.asarray(line.get_xdata()) * np.pi / 30)
        )
    assert drawn is given
    plt.close("all")
