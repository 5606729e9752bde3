"""Small dense least squares against NumPy's and SciPy's."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from fitting.solvers.dense import bounded_least_squares, least_squares_solve, orthogonal_triangle

ROWS, COLUMNS = 8, 5
_solve = jax.jit(least_squares_solve)
_triangle = jax.jit(orthogonal_triangle)
_bounded = jax.jit(bounded_least_squares)
_seeds = st.integers(0, 2**32 - 1)


def _problem(seed, decades=2.0):
    """A random problem whose columns differ in size by some decades."""
    random = np.random.default_rng(seed)
    matrix = random.standard_normal((ROWS, COLUMNS)) * 10.0 ** random.uniform(-decades, decades, COLUMNS)
    return random, matrix, random.standard_normal(ROWS)


@given(_seeds)
@settings(max_examples=100, deadline=None)
def test_like_numpy(seed):
    _, matrix, target = _problem(seed, decades=4.0)
    norms = np.linalg.norm(matrix, axis=0)
    expected = np.linalg.lstsq(matrix / norms, target, rcond=None)[0]
    np.testing.assert_allclose(_solve(matrix, target) * norms, expected, rtol=0, atol=1e-9 * np.max(np.abs(expected)))


@pytest.mark.parametrize("rows", [1, 2, 7])
def test_square_and_tall(rows):
    random = np.random.default_rng(rows)
    columns = min(rows, 3)
    matrix, target = random.standard_normal((rows, columns)), random.standard_normal(rows)
    expected = np.linalg.lstsq(matrix, target, rcond=None)[0]
    np.testing.assert_allclose(least_squares_solve(jnp.asarray(matrix), jnp.asarray(target)), expected, rtol=1e-11)


def test_trap_28_keeps_the_digits_that_normal_equations_lose():
    random = np.random.default_rng(0)
    left, right = (
        np.linalg.qr(random.standard_normal((ROWS, COLUMNS)))[0],
        np.linalg.qr(random.standard_normal((COLUMNS, COLUMNS)))[0],
    )
    matrix = left * np.logspace(0, -5, COLUMNS) @ right
    solution = random.standard_normal(COLUMNS)
    np.testing.assert_allclose(_solve(matrix, matrix @ solution), solution, rtol=0, atol=1e-10)


def test_trap_28_no_full_rank_is_not_finite():
    matrix = np.ones((ROWS, COLUMNS))
    matrix[:, 1] = 0.0
    assert not np.all(np.isfinite(_solve(matrix, np.ones(ROWS))))


@given(_seeds)
@settings(max_examples=200, deadline=None)
def test_bounded_like_scipy(seed):
    random, matrix, target = _problem(seed)
    norms = np.linalg.norm(matrix, axis=0)
    damping = norms * 10.0 ** random.uniform(-3, 0)
    reach = random.uniform(0, 1, (2, COLUMNS)) / norms
    # Some bounds are hit at the start, some are not there.
    reach[random.uniform(size=reach.shape) < 0.2] = 0.0
    reach[random.uniform(size=reach.shape) < 0.2] = np.inf
    lower, upper = -reach[0], np.where(reach[1] == 0, 1e-9 / norms, reach[1])

    x, active = (np.asarray(out) for out in _bounded(matrix, target, damping, lower, upper))
    # In normalised columns, which SciPy's own tolerance wants.
    stacked = np.concatenate([matrix, np.diag(damping)]) / norms
    right = np.concatenate([target, np.zeros(COLUMNS)])
    expected = lsq_linear(stacked, right, (lower * norms, upper * norms), method="bvls", tol=1e-15).x / norms

    assert np.all((lower <= x) & (x <= upper))
    np.testing.assert_allclose(x * norms, expected * norms, atol=1e-9)
    assert np.all(((x == lower) | (x == upper))[active])
    gradient = stacked.T @ (stacked @ (x * norms) - right)
    np.testing.assert_allclose(gradient[~active], 0.0, atol=1e-9)
    assert np.all(gradient[active & (x == lower)] >= -1e-9)
    assert np.all(gradient[active & (x == upper)] <= 1e-9)


def test_without_bounds_it_is_the_damped_solution():
    _, matrix, target = _problem(3)
    damping = np.linalg.norm(matrix, axis=0)
    free = np.full(COLUMNS, np.inf)
    x, active = _bounded(matrix, target, damping, -free, free)
    stacked = np.concatenate([matrix, np.diag(damping)])
    expected = np.linalg.lstsq(stacked, np.concatenate([target, np.zeros(COLUMNS)]), rcond=None)[0]
    np.testing.assert_allclose(x, expected, rtol=1e-10)
    assert not np.any(active)


def test_a_batch_equals_its_members():
    problems = [_problem(seed) for seed in range(20)]
    matrices, targets = (np.stack([p[i] for p in problems]) for i in (1, 2))
    damping = 0.1 * np.linalg.norm(matrices, axis=1)
    bound = 0.3 / np.linalg.norm(matrices, axis=1)
    together = jax.jit(jax.vmap(bounded_least_squares))(matrices, targets, damping, -bound, bound)
    for i in range(len(problems)):
        alone = _bounded(matrices[i], targets[i], damping[i], -bound[i], bound[i])
        np.testing.assert_allclose(together[0][i], alone[0], rtol=1e-9, atol=1e-12)
        np.testing.assert_array_equal(together[1][i], alone[1])


@given(_seeds)
@settings(max_examples=100, deadline=None)
def test_triangle_like_lapack(seed):
    """Up to the signs of the rows, of columns that differ by many decades."""
    random = np.random.default_rng(seed)
    matrix = random.standard_normal((40, 6)) * 10.0 ** random.uniform(-80, 80, 6)
    vector = random.standard_normal(40)
    triangle, projected = (np.asarray(part) for part in _triangle(matrix, vector))
    norms = np.linalg.norm(matrix, axis=0)
    expected = np.linalg.qr(np.column_stack([matrix / norms, vector]), mode="r")
    signs = np.sign(np.diag(expected)[:6])
    np.testing.assert_allclose(triangle / norms, signs[:, None] * expected[:6, :6], atol=1e-13)
    np.testing.assert_allclose(projected, signs * expected[:6, 6], atol=1e-12)


@pytest.mark.parametrize("condition", [1e3, 1e6, 1e9, 1e12])
def test_trap_28_triangle_keeps_the_smallest_singular_value(condition):
    random = np.random.default_rng(1)
    left, right = (np.linalg.qr(random.standard_normal(shape))[0] for shape in ((300, 7), (7, 7)))
    matrix = left * np.geomspace(1.0, 1 / condition, 7) @ right
    singular = np.linalg.svd(np.asarray(_triangle(matrix, np.ones(300))[0]))[1]
    # What rounding of the matrix itself does to it.
    np.testing.assert_allclose(singular[-1] * condition, 1.0, atol=100 * condition * np.finfo(float).eps)


@pytest.mark.parametrize("rows", [3, 6, 50])
def test_trap_28_triangle_of_columns_that_hang_together(rows):
    random = np.random.default_rng(rows)
    matrix = random.standard_normal((rows, 6))
    matrix[:, 1], matrix[:, 4] = 0.0, matrix[:, 0] - 2 * matrix[:, 2]
    triangle, projected = (np.asarray(part) for part in _triangle(matrix, np.ones(rows)))
    rank = np.linalg.matrix_rank(matrix)
    np.testing.assert_array_equal(np.sum(np.diag(triangle) > 0), rank)
    np.testing.assert_allclose(triangle.T @ triangle, matrix.T @ matrix, atol=1e-12)
    np.testing.assert_allclose(triangle.T @ projected, matrix.T @ np.ones(rows), atol=1e-11)
    np.testing.assert_array_equal(projected[np.diag(triangle) == 0], 0.0)
