"""Factors of small matrices against numpy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.solvers.factor import inverse_of_lower, solve_upper, triangular_factor

SIZES = [(1, 1), (4, 4), (9, 5)]


@pytest.mark.parametrize("size", SIZES)
def test_triangular_factor_is_that_of_numpy(size: tuple[int, int]):
    matrices = np.random.default_rng(1).normal(size=(5, *size))
    factors = jax.vmap(triangular_factor)(jnp.asarray(matrices))
    for matrix, factor in zip(matrices, factors, strict=True):
        known = np.linalg.qr(matrix, mode="r")
        np.testing.assert_allclose(factor, known * np.sign(np.diag(known))[:, None], rtol=1e-12, atol=1e-13)


def test_triangular_factor_of_a_deficient_matrix_has_zeros_and_no_nan():
    matrix = jnp.asarray([[0.0, 1.0, 2.0], [0.0, 2.0, 4.0], [0.0, 0.0, 0.0]])
    factor = triangular_factor(matrix)
    np.testing.assert_allclose(factor.T @ factor, matrix.T @ matrix, atol=1e-14)
    np.testing.assert_allclose(np.diag(factor)[0], 0.0)


@pytest.mark.parametrize("scale", [1e-200, 1e200])
def test_triangular_factor_neither_vanishes_nor_overflows(scale: float):
    matrix = np.random.default_rng(2).normal(size=(4, 3))
    small, usual = (triangular_factor(jnp.asarray(matrix * factor)) for factor in (scale, 1.0))
    np.testing.assert_allclose(small / scale, usual, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("n", [1, 7])
def test_substitution_is_that_of_numpy(n: int):
    rng = np.random.default_rng(3)
    triangle = np.triu(rng.normal(size=(n, n))) + 3 * np.eye(n)
    target = rng.normal(size=n)
    np.testing.assert_allclose(
        solve_upper(jnp.asarray(triangle), jnp.asarray(target)), np.linalg.solve(triangle, target), rtol=1e-11
    )
    inverse = inverse_of_lower(jnp.asarray(triangle.T))
    np.testing.assert_allclose(inverse, np.linalg.inv(triangle.T), rtol=1e-11, atol=1e-13)
    np.testing.assert_array_equal(np.triu(inverse, 1), 0.0)
