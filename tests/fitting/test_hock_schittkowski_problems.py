"""The collection of Hock and Schittkowski: each stored answer is feasible and has the stored f."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.problems.hock_schittkowski import PROBLEMS

EACH_PROBLEM = pytest.mark.parametrize("problem", PROBLEMS, ids=lambda problem: problem.name)


def test_collection_is_large_and_names_are_unique():
    assert len(PROBLEMS) >= 75
    assert len({problem.name for problem in PROBLEMS}) == len(PROBLEMS)


@EACH_PROBLEM
def test_stored_solution_is_feasible_and_has_the_stored_optimum(problem):
    x = problem.solution
    assert x.shape == problem.start.shape == problem.lower.shape == problem.upper.shape
    np.testing.assert_allclose(float(problem.objective(x)), problem.optimum, rtol=1e-7, atol=1e-9)
    assert np.all(x >= problem.lower - 1e-7) and np.all(x <= problem.upper + 1e-7)
    if problem.equality is not None:
        np.testing.assert_allclose(np.asarray(problem.equality(x)), 0.0, atol=1e-7)
    if problem.inequality is not None:
        assert np.asarray(problem.inequality(x)).min() >= -1e-7


@pytest.mark.parametrize("name", ["HS67", "HS71", "HS92", "HS118"])
def test_functions_can_be_compiled_batched_and_differentiated(name):
    problem = next(problem for problem in PROBLEMS if problem.name == name)
    both = jnp.stack([jnp.asarray(problem.start), jnp.asarray(problem.solution)])
    gradients = jax.jit(jax.vmap(jax.grad(problem.objective)))(both)
    jacobians = jax.jit(jax.vmap(jax.jacfwd(problem.inequality)))(both)
    assert gradients.shape == both.shape and jacobians.shape[::2] == both.shape
    assert np.all(np.isfinite(gradients)) and np.all(np.isfinite(jacobians))
