"""A test with a roving hammer is turned around: shapes at the points that were hit."""

import jax.numpy as jnp
import numpy as np
import pytest
from modal_systems import FREQUENCY, RATIO, response, shapes_for

from fitting.identification.modal_analysis import modal_analysis
from fitting.identification.modal_reciprocity import same_direction, turned_around
from twin.frf import FRF

SHAPES = shapes_for(6)


@pytest.fixture(scope="module")
def roving_sensor():
    return response(FREQUENCY, RATIO, SHAPES, inputs=(0, 4), form="accelerance", noise=0.005)[0]


@pytest.fixture(scope="module")
def roving_hammer(roving_sensor):
    return turned_around(roving_sensor)


def test_shapes_are_those_of_the_points_that_were_hit(roving_hammer, roving_sensor):
    assert roving_hammer.values.shape[:2] == (2, 8)
    analysis, direct = modal_analysis(roving_hammer), modal_analysis(roving_sensor)
    assert analysis.reciprocal and not direct.reciprocal
    assert analysis.measured.outputs == roving_hammer.inputs and analysis.mass_normalised
    sign = np.sign(np.sum(np.real(analysis.shapes) * SHAPES, axis=0))
    np.testing.assert_allclose(analysis.shapes * sign, SHAPES, atol=0.05)
    np.testing.assert_array_equal(analysis.frequency, direct.frequency)
    assert "by reciprocity, which holds for passive structures" in analysis.message
    assert "in 2 responses to 8 excitations" in analysis.message


def test_it_is_done_only_where_it_is_wanted(roving_hammer, roving_sensor):
    assert modal_analysis(roving_hammer, modes=2, order=10, reciprocal=False).shapes.shape == (2, 2)
    assert modal_analysis(roving_sensor, modes=2, order=10, reciprocal=True).shapes.shape == (2, 2)


def test_variances_are_turned_as_well(roving_sensor):
    variance = jnp.arange(1.0, 1 + roving_sensor.values.size).reshape(roving_sensor.values.shape)
    frf = turned_around(roving_sensor.with_variance(variance))
    assert frf.variance is not None
    np.testing.assert_array_equal(frf.standard_deviation("5 x", "3 x"), jnp.sqrt(variance[2, 1]))
    np.testing.assert_array_equal(turned_around(frf).values, roving_sensor.values)


def test_a_point_hit_against_its_sensor_is_a_driving_point():
    names = tuple(f"{i} z" for i in range(1, 9))
    true, _ = response(FREQUENCY, RATIO, SHAPES, form="accelerance")
    frf = FRF(true.frequency, -true.values, names, ("1 -z",), true.form)
    analysis = modal_analysis(frf)
    assert analysis.mass_normalised
    sign = np.sign(np.sum(np.real(analysis.shapes) * SHAPES, axis=0))
    np.testing.assert_allclose(analysis.shapes * sign, SHAPES, atol=1e-6)


@pytest.mark.parametrize(
    "one, other, sign",
    [
        ("3 z", "3 z", 1),
        ("3 z", "3 -z", -1),
        ("3 -z", "3 z", -1),
        ("3 -z", "3 -z", 1),
        ("3 z", "4 -z", 0),
        ("3 z", "3 -x", 0),
        ("table", "table", 1),
        ("table", "-table", 0),
    ],
)
def test_names_of_one_point(one, other, sign):
    assert same_direction(one, other) == sign
