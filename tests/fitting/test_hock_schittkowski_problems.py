"""The collection of Hock and Schittkowski: each stored answer is feasible and has the stored f."""

import numpy as np
import pytest

from tests.problems.hock_schittkowski import PROBLEMS
from tests.problems.programme_runs import functions_of

EACH_PROBLEM = pytest.mark.parametrize("problem", PROBLEMS, ids=lambda problem: problem.name)


def test_collection_is_large_and_names_are_unique():
    assert len(PROBLEMS) >= 75
    assert len({problem.name for problem in PROBLEMS}) == len(PROBLEMS)


@EACH_PROBLEM
def test_stored_solution_is_feasible_and_has_the_stored_optimum(problem):
    x = problem.solution
    assert x.shape == problem.start.shape == problem.lower.shape == problem.upper.shape
    functions = functions_of(problem)
    values, slopes = functions.at(x)
    equality, inequality = np.split(values[1:], [functions.equalities])
    np.testing.assert_allclose(values[0], problem.optimum, rtol=1e-7, atol=1e-9)
    assert np.all(x >= problem.lower - 1e-7) and np.all(x <= problem.upper + 1e-7)
    np.testing.assert_allclose(equality, 0.0, atol=1e-7)
    assert np.all(inequality >= -1e-7)
    assert inequality.size == functions.inequalities
    assert np.all(np.isfinite(slopes))
