"""SLSQP where problems are awkward: contradictions, missing values, no minimum, vertices with too many constraints."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.solvers.stop import CONVERGED
from tests.fitting.solvers.slsqp_runs import Answer, solve_programme


class Quadratics(NamedTuple):
    """w·x² + v·x, likewise one equality and three inequalities; NaN where x0 lies between two limits."""

    objective: np.ndarray = np.array([[1.0, 1.0], [0.0, 0.0]])
    equality: np.ndarray = np.zeros((2, 2))
    equality_constant: float = 0.0
    inequality: np.ndarray = np.zeros((2, 3, 2))
    constants: np.ndarray = np.ones(3)
    forbidden: np.ndarray = np.array([np.inf, np.inf])

    def solve(self, start, lower=(-np.inf, -np.inf), upper=(np.inf, np.inf)) -> Answer:
        vectors = (np.asarray(vector, float) for vector in (start, lower, upper))
        args = jax.tree.map(lambda leaf: np.asarray(leaf, float), tuple(self))
        return solve_programme(_quadratic, _quadratic_equality, _quadratic_inequality, *vectors, args)


def _quadratic(x, args):
    (w, v), (low, high) = args[0], args[5]
    return jnp.where((x[0] > low) & (x[0] < high), jnp.nan, jnp.sum(w * x**2 + v * x))


def _quadratic_equality(x, args):
    # A scalar: any shape is taken.
    return jnp.sum(args[1][0] * x**2 + args[1][1] * x) + args[2]


def _quadratic_inequality(x, args):
    return args[3][0] @ x**2 + args[3][1] @ x + args[4]


def _rows(squares, slopes):
    return np.array([squares, slopes], float)


ABOVE_AND_BELOW = [[1, 0], [-1, 0], [0, 1]]


def test_contradicting_linear_constraints_end_as_infeasible_between_them():
    """x0 ≥ 3 and x0 ≤ 1: the least sum of squares is at 2."""
    answer = Quadratics(inequality=_rows(np.zeros((3, 2)), ABOVE_AND_BELOW), constants=np.array([-3, 1, -0.5])).solve(
        [1, 2]
    )
    assert answer.why == "infeasible" and not answer.successful
    np.testing.assert_allclose(answer.x[0], 2.0, atol=1e-6)
    np.testing.assert_allclose(answer.violation, 1.0, atol=1e-6)


def test_contradicting_nonlinear_constraints_end_as_infeasible_between_them():
    """x0² ≥ 3 and x0² ≤ 1: the least sum of squares is at x0² = 2."""
    answer = Quadratics(inequality=_rows(ABOVE_AND_BELOW, np.zeros((3, 2))), constants=np.array([-3, 1, -0.5])).solve(
        [1, 2]
    )
    assert answer.why == "infeasible" and not answer.successful
    np.testing.assert_allclose(answer.x[0] ** 2, 2.0, atol=1e-5)


def test_an_equality_without_a_root_ends_as_infeasible_where_it_is_least():
    answer = Quadratics(equality=_rows([1, 0], [0, 0]), equality_constant=1.0).solve([0.1, 2])
    assert answer.why == "infeasible" and not answer.successful
    np.testing.assert_allclose(answer.x[0], 0.0, atol=1e-3)
    np.testing.assert_allclose(answer.violation, 1.0, atol=1e-6)


def test_a_saddle_of_the_violation_is_left():
    """x0² + x1² = 1 from the origin, where the violation is stationary; the objective tells the way."""
    answer = Quadratics(
        objective=np.array([[0, 0], [1, 1]]), equality=_rows([1, 1], [0, 0]), equality_constant=-1.0
    ).solve([0, 0])
    assert answer.why in CONVERGED
    np.testing.assert_allclose(answer.x, -np.sqrt(0.5), atol=1e-6)


def test_a_start_that_is_not_finite_is_said_so():
    answer = Quadratics(forbidden=np.array([-1, 1])).solve([0, 2])
    assert answer.why == "not_finite" and not answer.successful


def test_a_region_without_values_is_backed_out_of():
    """From 6 the first step to the minimum at 1 goes to -4: NaN between -9 and 0."""
    answer = Quadratics(objective=np.array([[1, 1], [-2, 0]]), forbidden=np.array([-9, 0])).solve([6, 3])
    assert answer.why in CONVERGED
    np.testing.assert_allclose(answer.x, [1, 0], atol=1e-6)


@pytest.mark.parametrize("objective", [[[0, 0], [-1, 0]], [[-1, 1], [1, 0]]], ids=["linear", "concave"])
def test_an_unbounded_objective_is_no_success(objective):
    answer = Quadratics(objective=np.array(objective)).solve([0.1, 1])
    assert answer.why not in CONVERGED and answer.why != "running"
    assert not answer.successful


def test_pinned_variables_stay_and_a_start_on_a_bound_leaves_it():
    """Trap 29: a start on a bound can stall."""
    answer = Quadratics(objective=np.array([[1, 1], [-4, 0]])).solve([0, 3], lower=[0, 3], upper=[9, 3])
    assert answer.why in CONVERGED
    np.testing.assert_allclose(answer.x, [2, 3], atol=1e-7)
    assert answer.x[1] == 3


def test_redundant_equality_and_inequality_on_one_line():
    """x0 + x1 = 1 three times over, once as an equality and twice as inequalities from both sides."""
    answer = Quadratics(
        equality=_rows([0, 0], [1, 1]),
        equality_constant=-1.0,
        inequality=_rows(np.zeros((3, 2)), [[1, 1], [-1, -1], [0, 0]]),
        constants=np.array([-1, 1, 0]),
    ).solve([4, -1])
    assert answer.why in CONVERGED
    np.testing.assert_allclose(answer.x, 0.5, atol=1e-7)
