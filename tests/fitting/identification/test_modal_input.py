"""Modal analysis of what cannot be analysed says why, and what was not taken is told."""

import re

import jax.numpy as jnp
import numpy as np
import pytest
from modal_systems import FREQUENCY, LINES, RATIO, response, shapes_for

from fitting.identification.modal_analysis import modal_analysis
from fitting.identification.modal_selection import Candidate, chosen
from twin._checks import InputError
from twin.frf import FRF


@pytest.fixture(scope="module")
def frf():
    return response(FREQUENCY, RATIO, shapes_for(6), noise=0.01)[0]


def with_values(frf, values, form=None):
    return FRF(frf.frequency, jnp.asarray(values), frf.outputs, frf.inputs, form or frf.form)


@pytest.mark.parametrize(
    "arguments, said",
    [
        ({"form": "ratio"}, "Say by form"),
        ({"damping": "coulomb"}, "viscous, hysteretic"),
        ({"band": (50.0, 20.0)}, "lower and a higher"),
        ({"band": (200.0, 300.0)}, "No line lies"),
        ({"band": (20.0, 20.5)}, "too few"),
        ({"order": 2}, "3 orders or more"),
        ({"modes": 40}, "Ask for as many or fewer"),
        ({"modes": [45.0]}, "No stable pole lies within 5 % of 45 Hz"),
        ({"modes": [-1.0]}, "must be positive"),
    ],
)
def test_arguments_that_cannot_be(frf, arguments, said):
    with pytest.raises(InputError, match=said):
        modal_analysis(frf, **arguments)


def test_values_that_cannot_be(frf):
    values = np.array(frf.values)
    values[0, 0, 3] = np.nan
    with pytest.raises(InputError, match="finite"):
        modal_analysis(with_values(frf, values))
    with pytest.raises(InputError, match="zero"):
        modal_analysis(with_values(frf, 0 * np.array(frf.values)))
    with pytest.raises(InputError, match="positive"):
        modal_analysis(frf.with_variance(jnp.zeros(frf.values.shape)))


def test_noise_alone_has_no_modes():
    random = np.random.default_rng(4)
    values = random.standard_normal((8, 1, LINES.size)) + 1j * random.standard_normal((8, 1, LINES.size))
    names = tuple(f"{i} x" for i in range(8))
    try:
        analysis = modal_analysis(FRF(jnp.asarray(LINES), jnp.asarray(values), names, ("0 x",), "receptance"))
    except InputError as error:
        assert "stable" in str(error)
    else:  # a chance pole explains next to nothing, and the message says so
        assert analysis.error > 0.9


def test_modes_wanted(frf):
    assert modal_analysis(frf, modes=2).frequency.size == 2
    named = modal_analysis(frf, modes=[80.5, 20.0])
    assert named.frequency == pytest.approx([20.0, 80.0], rel=1e-2)
    assert "hangs together" in named.message  # four modes are missing


@pytest.mark.parametrize("stated, angle", [("receptance", 180), ("mobility", 90)])
def test_a_wrong_form_shows_at_the_driving_point(stated, angle):
    frf, _ = response(FREQUENCY, RATIO, shapes_for(6), form="accelerance")
    analysis = modal_analysis(frf, form=stated)
    np.testing.assert_allclose(analysis.frequency, FREQUENCY, rtol=1e-4)
    assert not analysis.mass_normalised
    assert "of another form" in analysis.message
    seen = re.search(r"turned by (\d+)°", analysis.message)
    assert seen and float(seen[1]) == pytest.approx(angle, abs=5)


def test_the_line_at_zero_is_left_out():
    frf, _ = response(FREQUENCY, RATIO, shapes_for(6), np.arange(0.0, 110.0, 0.25))
    analysis = modal_analysis(frf)
    assert "0 Hz was left out" in analysis.message
    np.testing.assert_allclose(analysis.frequency, FREQUENCY, rtol=1e-6)


def test_a_line_at_zero_outside_of_the_band_is_not_told():
    frf, _ = response(FREQUENCY, RATIO, shapes_for(6), np.arange(0.0, 110.0, 0.25))
    assert "0 Hz was left out" not in modal_analysis(frf, band=(10.0, 50.0)).message


@pytest.mark.parametrize("rare", [[], [Candidate(-3.0 + 2800.0j, np.ones(1), 2, 4)]])
def test_a_band_without_modes_is_told(rare):
    with pytest.raises(InputError, match=r"stable in 400 to 480 Hz.*there seems to be no mode"):
        chosen(rare, None, 30, (400.0, 480.0))


def test_order_is_lowered_to_what_the_lines_allow():
    frf, _ = response([40.0, 60.0], [0.05, 0.04], shapes_for(2), np.linspace(30.0, 70.0, 16))
    assert "The order was lowered to 10" in modal_analysis(frf, order=30).message
