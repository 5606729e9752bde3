"""Small quadratic programmes: optimality conditions over random batches, every active set, and awkward cases."""

import itertools
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.solvers.quadratic_programme import quadratic_programme
from tests.problems.programme_runs import QUICK

# Variables, constraints, equalities among them.
SHAPES = [(1, 0, 0), (3, 3, 1), (6, 8, 2), (12, 5, 4)]


@partial(jax.jit, static_argnums=6, compiler_options=QUICK)
def _batch(factor, gradient, normals, values, lower, upper, equalities):
    solve = partial(quadratic_programme, equalities=equalities)
    return jax.vmap(solve)(factor, gradient, normals, values, lower, upper)


def _one(factor, gradient, normals, values, lower, upper, equalities=0):
    parts = (jnp.asarray(part, dtype=float)[None] for part in (factor, gradient, normals, values, lower, upper))
    return jax.tree.map(lambda leaf: leaf[0], _batch(*parts, equalities))


def _random(n, m, equalities, count, seed):
    """Feasible programmes: bounds on half of the variables, a pinned one, some constraints through one vertex."""
    rng = np.random.default_rng(seed)
    factor = 0.3 * np.tril(rng.normal(size=(count, n, n)))
    factor[:, range(n), range(n)] = 1.0 + rng.uniform(0, 1, (count, n))
    gradient = 3 * rng.normal(size=(count, n))
    normals = rng.normal(size=(count, m, n))
    inside = rng.uniform(-1, 1, (count, n))
    inside[rng.random((count, n)) < 0.2] = 1.0
    slack = rng.uniform(0, 1, (count, m)) * (rng.random((count, m)) < 0.5)
    values = np.where(np.arange(m) < equalities, 0.0, slack) - np.einsum("kij,kj->ki", normals, inside)
    lower = np.where(rng.random((count, n)) < 0.5, -1.0, -np.inf)
    upper = np.where(rng.random((count, n)) < 0.5, 1.0, np.inf)
    if n > 1:
        lower[:, 0] = upper[:, 0] = inside[:, 0]
    return tuple(jnp.asarray(part) for part in (factor, gradient, normals, values, lower, upper))


def _check_conditions(programme, answer, equalities, tolerance=1e-10):
    factor, gradient, normals, values, lower, upper = (np.asarray(part) for part in programme)
    step, dual, pull = (np.asarray(part) for part in answer[:3])
    hessian = factor @ np.swapaxes(factor, 1, 2)
    balance = np.einsum("kij,kj->ki", hessian, step) + gradient - np.einsum("kij,ki->kj", normals, dual) - pull
    rest = np.einsum("kij,kj->ki", normals, step) + values
    size = 1.0 + np.abs(dual).max(axis=1, initial=0.0)[:, None]
    assert np.all(answer.feasible)
    assert np.all(np.abs(balance) <= tolerance * size)
    assert np.all(np.abs(rest[:, :equalities]) <= tolerance)
    assert np.all(rest[:, equalities:] >= -tolerance) and np.all(dual[:, equalities:] >= 0)
    assert np.all((step >= lower) & (step <= upper))
    assert np.all(np.abs(dual[:, equalities:] * rest[:, equalities:]) <= tolerance * size)
    assert np.all(np.where(pull > 0, step - lower, 0.0) <= tolerance)
    assert np.all(np.where(pull < 0, upper - step, 0.0) <= tolerance)


@pytest.mark.parametrize("shape", SHAPES)
def test_optimality_conditions_hold_over_a_random_batch_with_vertices_and_pinned_variables(shape):
    programme = _random(*shape, count=200, seed=sum(shape))
    _check_conditions(programme, _batch(*programme, shape[2]), shape[2])


def test_the_minimum_is_the_best_of_all_active_sets():
    n, m = 3, 3
    programme = _random(n, m, 1, count=12, seed=5)
    steps = np.asarray(_batch(*programme, 1).step)
    for k, (factor, gradient, normals, values, lower, upper) in enumerate(zip(*programme, strict=True)):
        rows = np.concatenate([normals, np.eye(n), -np.eye(n)])
        offsets = np.concatenate([values, -lower, upper])
        hessian = np.asarray(factor @ factor.T)
        best = np.inf
        limited = [row for row in range(1, rows.shape[0]) if np.isfinite(offsets[row])]
        for count in range(n):
            for chosen in itertools.combinations(limited, count):
                active = [0, *chosen]
                matrix = np.block([[hessian, -rows[active].T], [rows[active], np.zeros((count + 1,) * 2)]])
                target = np.concatenate([-np.asarray(gradient), -offsets[active]])
                step = np.linalg.lstsq(matrix, target, rcond=None)[0][:n]
                rest = rows @ step + offsets
                if abs(rest[0]) <= 1e-9 and np.all(rest[1:] >= -1e-9):
                    best = min(best, float(0.5 * step @ hessian @ step + gradient @ step))
        value = 0.5 * steps[k] @ hessian @ steps[k] + gradient @ steps[k]
        np.testing.assert_allclose(value, best, rtol=1e-9, atol=1e-9)


def test_many_constraints_through_one_vertex():
    angles = np.linspace(0.0, np.pi, 9)
    normals = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    answer = _one(np.eye(2), [1.0, 5.0], normals, np.zeros(9), [-np.inf] * 2, [np.inf] * 2)
    assert answer.feasible
    np.testing.assert_allclose(answer.step, 0.0, atol=1e-15)
    np.testing.assert_allclose(normals.T @ answer.multipliers, [1.0, 5.0], rtol=1e-12)


def test_redundant_equalities_are_solved_and_their_multipliers_balance():
    normals = np.array([[1.0, 2.0, 0.0], [2.0, 4.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 1.0]])
    answer = _one(np.eye(3), [1.0, 1.0, 1.0], normals, [-1.0, -2.0, 0.0, -0.5], [-9.0] * 3, [9.0] * 3, equalities=4)
    assert answer.feasible
    np.testing.assert_allclose(normals @ answer.step, [1.0, 2.0, 0.0, 0.5], rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(answer.step + 1.0, normals.T @ answer.multipliers, rtol=1e-12)


CONTRADICTIONS = {
    "equalities": ([[1.0, 1.0], [1.0, 1.0]], [0.0, 1.0], 2, -9.0, 9.0),
    "inequalities": ([[1.0, 0.0], [-1.0, 0.0]], [-1.0, 0.5], 0, -9.0, 9.0),
    "equality and bounds": ([[1.0, 1.0], [0.0, 0.0]], [-3.0, 0.0], 1, -1.0, 1.0),
    "inequality and bounds": ([[1.0, 1.0], [0.0, 1.0]], [-3.0, 0.0], 0, -1.0, 1.0),
    "a constraint without variables": ([[0.0, 0.0], [0.0, 1.0]], [-1.0, 0.0], 0, -1.0, 1.0),
}


@pytest.mark.parametrize("name", CONTRADICTIONS)
def test_a_contradiction_is_infeasible(name: str):
    normals, values, equalities, lower, upper = CONTRADICTIONS[name]
    answer = _one(np.eye(2), [1.0, -2.0], normals, values, [lower] * 2, [upper] * 2, equalities)
    assert not answer.feasible
    assert np.all(np.isfinite(answer.step))


def test_a_free_minimum_far_away_leaves_no_rounding_behind():
    """A nearly singular B puts the free minimum at 1e15: its rounding must not hide a violated constraint."""
    factor = np.array([[1.0, 0.0], [-1e5, 1e-5]])
    answer = _one(factor, [-1e6, -1e6], [[-1.0, -1.0]], [0.5], [-1.0, -1.0], [1e3, 0.0])
    assert answer.feasible
    assert np.sum(answer.step) <= 0.5 + 1e-12
    hessian = factor @ factor.T
    balance = hessian @ np.asarray(answer.step) - 1e6 + answer.multipliers[0] - answer.bound_multipliers
    np.testing.assert_allclose(balance, 0.0, atol=1e-6 * 1e6)


def test_sizes_of_the_constraints_do_not_matter():
    programme = _random(6, 8, 2, count=50, seed=9)
    answer = _batch(*programme, 2)
    sizes = 10.0 ** np.random.default_rng(10).uniform(-7, 7, (50, 8))
    factor, gradient, normals, values, lower, upper = programme
    scaled = (factor, gradient, normals * sizes[..., None], values * sizes, lower, upper)
    again = _batch(*scaled, 2)
    assert np.all(again.feasible)
    np.testing.assert_allclose(again.step, answer.step, rtol=1e-8, atol=1e-9)


def test_skipped_lanes_return_zeros_and_a_nan_is_not_feasible():
    @partial(jax.jit, compiler_options=QUICK)
    def solve(gradient, skip):
        ones = jnp.ones(2)
        return quadratic_programme(jnp.eye(2), gradient, jnp.ones((1, 2)), jnp.ones(1), -ones, ones, skip=skip)

    np.testing.assert_array_equal(solve(jnp.ones(2), True).step, 0.0)
    assert not solve(jnp.asarray([1.0, jnp.nan]), False).feasible
