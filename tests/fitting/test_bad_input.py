"""Everything a user can get wrong about a fit has one clear error, or one clear status."""

import inspect

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.constraints import Equality, Inequality
from fitting.fit import FitError, fit
from fitting.multistart import multistart
from fitting.residuals.residual import AbstractResidual
from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt
from fitting.solvers.slsqp import SLSQP
from tests.fitting.curves import Coefficients, CurveResidual, box, line, noisy
from twin._checks import InputError
from twin.parameters import Parameter, ParameterSpace

SPACE = box(2, -10.0, 10.0)
START = Coefficients(jnp.asarray([0.0, 0.0]))


def evidence(x=None, y=None):
    clean = noisy(line, [1.0, 2.0], np.linspace(0, 1, 20), 0.1)
    if y is None:
        return clean if x is None else CurveResidual(line, x, np.zeros_like(x), np.asarray(0.1))
    return CurveResidual(line, clean.x, y, np.asarray(0.1))


class Matrix(AbstractResidual):
    """A residual that is no vector."""

    def __call__(self, model):
        return jnp.outer(model.b, model.b)


class Hostile(AbstractResidual):
    """A residual that exists only for b0 > 0."""

    def __call__(self, model):
        return jnp.stack([jnp.log(model.b[0]) - 1.0, model.b[1] - 3.0, model.b[1] - 3.0])


class Fickle(AbstractResidual):
    """A residual that is longer every time it is called."""

    calls: list = eqx.field(static=True)

    def __call__(self, model):
        self.calls.append(1)
        return jnp.zeros(2 + len(self.calls)) + model.b[0]


def test_residual_that_changes_its_shape():
    with pytest.raises(InputError, match="changes its shape from call to call"):
        fit(Fickle([]), START, SPACE)


def test_no_data():
    with pytest.raises(InputError, match="The residual is empty"):
        fit(evidence(x=np.zeros(0)), START, SPACE)


def test_more_parameters_than_data():
    with pytest.raises(InputError, match="1 residuals cannot determine 2 parameters"):
        fit(evidence(x=np.zeros(1)), START, SPACE)


def test_residual_that_is_no_vector():
    with pytest.raises(InputError, match="must be a vector"):
        fit(Matrix(), START, SPACE)


def test_start_that_is_not_finite():
    with pytest.raises(InputError, match=r"The start of b\.1 is nan"):
        fit(evidence(), Coefficients(jnp.asarray([0.0, np.nan])), SPACE)


def test_start_outside_its_bounds():
    with pytest.raises(InputError, match=r"b\.0 is 99.*outside its bounds"):
        fit(evidence(), Coefficients(jnp.asarray([99.0, 0.0])), SPACE)


def test_bounds_reversed():
    with pytest.raises(InputError, match=r"lower bound 2 is not below the upper bound 1"):
        Parameter("b.0", "", 2.0, 1.0)


@pytest.mark.parametrize("solver", [BoundedLevenbergMarquardt(), SLSQP()], ids=["LM", "SLSQP"])
def test_residual_that_is_not_finite_at_the_start(solver):
    samples = np.asarray(evidence().y).copy()
    samples[3] = np.nan
    result = fit(evidence(y=samples), START, SPACE, solver=solver)
    assert result.stop == "not_finite"
    assert not result.success
    assert "not finite at the start" in result.message
    with pytest.raises(FitError, match="not finite at the start"):
        fit(evidence(y=samples), START, SPACE, solver=solver, throw=True)


@pytest.mark.parametrize("solver", [BoundedLevenbergMarquardt(), SLSQP()], ids=["LM", "SLSQP"])
def test_region_without_a_residual_is_backed_out_of(solver):
    """From b0 = 9 a full step leads to b0 < 0, where the logarithm is NaN."""
    space = ParameterSpace([Parameter("b.0", "", size=1.0), Parameter("b.1", "", size=1.0)])
    result = fit(Hostile(), Coefficients(jnp.asarray([9.0, 0.0])), space, solver=solver)
    assert result.success
    np.testing.assert_allclose(result.values, [np.e, 3.0], rtol=1e-6)


def test_unknown_parameter():
    with pytest.raises(InputError, match="Unknown parameter path 'c'"):
        fit(evidence(), START, ParameterSpace([Parameter("c")]))


def returns_a_matrix(model):
    return jnp.outer(model.b, model.b)


def returns_a_comparison(model):
    return model.b > 0


def positive_first(model):
    return model.b[0] - 1.0


@pytest.mark.parametrize(
    ("constraint", "message"),
    [
        (Equality(returns_a_matrix), r"Constraint 0 returns \(2, 2\); return a number or a vector"),
        (Inequality(returns_a_comparison), "Constraint 0 returns bool values"),
    ],
)
def test_constraints_of_the_wrong_kind(constraint, message):
    with pytest.raises(InputError, match=message):
        fit(evidence(), START, SPACE, constraints=[constraint])


@pytest.mark.parametrize("procedure", [fit, multistart], ids=lambda p: p.__name__)
def test_a_constraint_by_itself(procedure):
    # Without the tests' check of types, as a user meets it.
    with pytest.raises(InputError, match=r"a single Inequality\. Put it into a list: constraints=\[constraint\]"):
        inspect.unwrap(procedure)(evidence(), START, SPACE, constraints=Inequality(positive_first))


def test_constraint_for_a_solver_that_takes_none():
    with pytest.raises(InputError, match="BoundedLevenbergMarquardt takes no general constraints"):
        fit(evidence(), START, SPACE, constraints=[Inequality(positive_first)], solver=BoundedLevenbergMarquardt())


def at_least_five(model):
    return model.b[0] - 5.0


def at_most_three(model):
    return 3.0 - model.b[0]


def test_contradicting_constraints_end_at_the_least_infeasible_point():
    result = fit(evidence(), START, SPACE, constraints=[Inequality(at_least_five), Inequality(at_most_three)])
    assert result.stop == "infeasible"
    assert not result.success
    assert "No point near here satisfies the constraints" in result.message
    assert result.values[0] == pytest.approx(4.0, abs=1e-3)


def beyond_the_bound(model):
    return model.b[1] - 11.0


def test_constraint_against_a_bound_ends_at_the_bound():
    result = fit(evidence(), START, SPACE, constraints=[Inequality(beyond_the_bound)])
    assert result.stop == "infeasible"
    assert result.values[1] == pytest.approx(10.0, abs=1e-6)


def sum_is_four(model):
    return model.b[0] + model.b[1] - 4.0


def test_constrained_fit_has_the_closed_form():
    """A line with b0 + b1 = 4 has one unknown: its least squares solution and standard error are sums."""
    data = evidence()
    result = fit(data, START, SPACE, constraints=[Equality(sum_is_four)])
    x, y = np.asarray(data.x), np.asarray(data.y)
    # b1 = 4 - b0: y = b0 + (4 - b0)·x, so y - 4x = b0·(1 - x).
    column, target = 1 - x, y - 4 * x
    b0 = column @ target / (column @ column)
    variance = np.sum((target - b0 * column) ** 2) / (x.size - 1) / (column @ column)
    assert result.success
    assert result.values[0] == pytest.approx(b0, rel=1e-7)
    assert result.values.sum() == pytest.approx(4.0, abs=1e-9)
    np.testing.assert_allclose(result.standard_errors, np.sqrt(variance), rtol=1e-6)
    assert result.correlation[0, 1] == pytest.approx(-1.0, abs=1e-9)
