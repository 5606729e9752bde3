"""Rails: a cubic spline through the shapes, twice continuously differentiable in the coordinate."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from twin._checks import InputError
from twin.structure import Rail

POINTS = np.array([-0.4, -0.25, -0.1, 0.0, 0.2, 0.3, 0.45])


def rail():
    return Rail(POINTS, np.random.default_rng(3).normal(size=(7, 6, 2)))


def test_is_scipys_spline():
    there = np.linspace(-0.4, 0.45, 23)
    expected = CubicSpline(POINTS, np.asarray(rail().shapes))(there)
    found = rail().at(there)
    assert found.shape == (23, 6, 2)
    assert np.allclose(found, expected, rtol=1e-12, atol=1e-12)
    assert np.allclose(rail().at(POINTS), rail().shapes, atol=1e-13)
    assert np.allclose(rail().at(0.17), CubicSpline(POINTS, np.asarray(rail().shapes))(0.17), atol=1e-12)


def test_two_derivatives_are_continuous_and_right():
    one = rail()
    first = jax.jit(jax.vmap(jax.jacfwd(one.at)))
    second = jax.jit(jax.vmap(jax.jacfwd(jax.jacfwd(one.at))))
    inside = POINTS[1:-1]
    for derivative, tolerance in ((first, 1e-6), (second, 1e-4)):
        below, above = derivative(inside - 1e-9), derivative(inside + 1e-9)
        assert np.allclose(below, above, rtol=tolerance, atol=tolerance), "continuous across the points"
    there = np.array([-0.4 + 1e-6, -0.31, 0.0, 0.2, 0.38])
    step = 1e-6
    differences = (np.asarray(one.at(there + step)) - np.asarray(one.at(there - step))) / (2 * step)
    assert np.allclose(first(there), differences, rtol=1e-7, atol=1e-7)


def test_reproduces_a_cubic_and_converges_with_the_fourth_power():
    cubic = POINTS**3 - 2 * POINTS
    assert np.allclose(Rail(POINTS, cubic[:, None, None] * np.ones((1, 6, 1))).at(0.07), 0.07**3 - 0.14, atol=1e-14)
    there, errors = np.linspace(0.0, 1.0, 301), []
    for count in (9, 17, 33):
        x = np.linspace(0.0, 1.0, count)
        found = Rail(x, np.sin(5 * x)[:, None, None] * np.ones((1, 6, 1))).at(there)[:, 0, 0]
        errors.append(np.max(np.abs(found - np.sin(5 * there))))
    assert errors[0] / errors[1] > 11 and errors[1] / errors[2] > 11


def test_linear_in_the_shapes():
    one = rail()
    slope = jax.jacfwd(lambda s: Rail(POINTS, s).at(0.17))(one.shapes)
    assert np.allclose(jnp.tensordot(slope, one.shapes, axes=3), one.at(0.17), atol=1e-13)


def test_ends_belong_to_the_rail_and_beyond_is_refused():
    one = rail()
    assert np.allclose(one.at(0.45 + 1e-12), one.shapes[-1], atol=1e-9)
    with pytest.raises(InputError, match=r"coordinate 0.5 m is off the rail.*-0.4 to 0.45"):
        one.at(0.5)
    marked = jax.jit(lambda s: one.at(s))(jnp.asarray([0.1, 0.5]))
    assert np.all(np.isfinite(marked[0])) and np.all(np.isnan(marked[1]))


@pytest.mark.parametrize(
    ("points", "shape", "message"),
    [
        (POINTS[:3], (3, 6, 2), "at least four"),
        (POINTS[::-1], (7, 6, 2), "increase"),
        (POINTS, (6, 6, 2), r"7 points.*\(6, 6, 2\)"),
    ],
)
def test_bad_rails(points, shape, message):
    with pytest.raises(InputError, match=message):
        Rail(points, np.zeros(shape))
