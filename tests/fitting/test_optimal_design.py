"""Designs with known optima: bounds, constraints, counts, failures, and errors in input."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.constraints import Equality, Inequality
from fitting.optimal_design import design
from twin._checks import InputError
from twin.parameters import Parameter, ParameterSpace


class Point(eqx.Module):
    x: jax.Array
    y: jax.Array


SPACE = ParameterSpace([Parameter("x", "m", -4.0, 4.0), Parameter("y", "m", -4.0, 4.0)])


def at(x, y):
    return Point(jnp.asarray(float(x)), jnp.asarray(float(y)))


def bowl(point):
    return (point.x - 1) ** 2 + 2 * (point.y - 2) ** 2


def half_plane(point):
    return 2.0 - point.x - point.y


def diagonal(point):
    return point.x - point.y


def cliff(point):
    return jnp.where(point.x > 0.9, jnp.nan, bowl(point))


def squares(point):
    return (point.x**2, point.y**2)


def radius(squared):
    return (squared[0] + squared[1] - 4.0) ** 2


class Named(eqx.Module):
    names: tuple[str, ...] = ("x from below", "y from above")

    def __call__(self, point):
        return jnp.stack([point.x + 5.0, 1.5 - point.y])


def test_free_optimum():
    result = design(at(-3, -3), bowl, SPACE)
    assert result.success
    np.testing.assert_allclose(result.values, [1, 2], atol=1e-5)
    assert result["y"] == result.values[1] == result.model.y
    np.testing.assert_array_equal(result.start, [-3, -3])
    assert not result.active.any()
    assert result.cost == pytest.approx(0.0, abs=1e-8)
    assert result.evaluations == result.history.size
    assert 2 <= result.gradients <= result.evaluations <= 20
    assert result.history[0] == bowl(at(-3, -3))


def test_active_bound():
    space = ParameterSpace([Parameter("x", "m", -4.0, 0.5), Parameter("y", "m", -4.0, 4.0)])
    result = design(at(-3, -3), bowl, space)
    np.testing.assert_allclose(result.values, [0.5, 2], atol=1e-5)
    assert result.active.tolist() == [True, False]
    assert "Held back by a bound: x." in result.message
    assert result.to_dataframe()["remark"].tolist() == ["at a bound", ""]


def test_active_inequality():
    """Without the limit of y the minimum would be at (1/3, 5/3)."""
    result = design(at(-3, -3), bowl, SPACE, constraints=[Inequality(half_plane), Inequality(Named())])
    np.testing.assert_allclose(result.values, [0.5, 1.5], atol=1e-5)
    assert result.constraint_names == ("half_plane", "x from below", "y from above")
    assert result.binding == ("half_plane", "y from above")
    assert "half_plane" in result.message
    assert "binding" in result._repr_html_()


def test_equalities_come_first():
    result = design(at(-3, -3), bowl, SPACE, constraints=[Inequality(half_plane), Equality(diagonal)])
    np.testing.assert_allclose(result.values, [1, 1], atol=1e-5)
    assert result.constraint_names == ("diagonal", "half_plane")
    np.testing.assert_allclose(result.constraint_values, 0.0, atol=1e-7)


def test_experiment_is_what_all_functions_see():
    def calm(squared):
        return 1.0 - squared[0]

    result = design(at(3, 0.5), radius, SPACE, constraints=[Inequality(calm)], experiment=squares)
    assert result.values[0] ** 2 + result.values[1] ** 2 == pytest.approx(4.0, abs=1e-3)
    assert abs(result.values[0]) <= 1.0 + 1e-7


def test_no_step_to_where_the_cost_is_not_a_number():
    result = design(at(-3, -3), cliff, SPACE)
    assert np.isfinite(result.cost)
    assert result.values[0] <= 0.9
    assert np.all(np.isfinite(result.history))


@pytest.mark.slow
def test_failures_are_told():
    start = design(at(2, 2), cliff, SPACE)
    assert start.stop == "not_finite"
    assert np.isnan(start.cost)
    assert "not finite at the start" in start.message
    short = design(at(-3, -3), bowl, SPACE, max_steps=1)
    assert short.stop == "too_many_steps"
    assert short.evaluations == 2
    nowhere = design(at(-3, -3), bowl, SPACE, constraints=[Inequality(lambda p: -1.0 - p.x**2)])
    assert nowhere.stop == "infeasible"


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"objective": lambda p: jnp.stack([p.x, p.y])}, r"objective returns float64\[2\]"),
        ({"objective": lambda p: p.x > 0}, "one real number"),
        ({"model": at(5, 0)}, "outside its bounds"),
        ({"max_steps": 0}, "max_steps must be at least 1"),
    ],
)
def test_bad_input(given, message):
    arguments = {"model": at(0, 0), "objective": bowl, "space": SPACE} | given
    with pytest.raises(InputError, match=message):
        design(**arguments)


def test_unknown_parameter_of_a_result():
    with pytest.raises(InputError, match="was not designed"):
        design(at(0, 0), bowl, SPACE)["z"]
