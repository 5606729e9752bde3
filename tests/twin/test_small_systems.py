"""Small dense systems against LAPACK, their derivatives, and what singular ones give."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin._small_systems import MOST, eliminated, solve_many, solved_alone


def systems(n, columns, count, seed=0):
    rng = np.random.default_rng(seed)

    def draw(*shape):
        return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)

    return jnp.asarray(draw(n, n, count)), jnp.asarray(draw(n, columns, count))


@pytest.mark.parametrize("n", [1, 2, 7, MOST + 1])
def test_solutions_are_lapacks(n):
    a, b = systems(n, 3, 11)
    found = np.moveaxis(np.asarray(solve_many(a, b)), -1, 0)
    np.testing.assert_allclose(found, np.linalg.solve(np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)), rtol=1e-11)


def test_rows_are_exchanged_where_a_pivot_is_zero():
    a = jnp.asarray([[0.0, 1.0], [2.0, 0.0]])[..., None]
    np.testing.assert_array_equal(solve_many(a, jnp.asarray([[3.0], [4.0]])[..., None])[:, 0, 0], [2.0, 3.0])


def test_rows_of_very_different_units():
    """A state matrix in rad, rad/s and N/µm."""
    a, b = systems(5, 2, 6)
    units = 10.0 ** jnp.asarray([6.0, -3.0, 0.0, 9.0, -6.0])[:, None, None]
    np.testing.assert_allclose(solve_many(a * units, b * units), solve_many(a, b), rtol=1e-10)


def test_a_singular_system_is_not_finite_and_leaves_the_others_alone():
    a, b = systems(3, 1, 2)
    whole = solve_many(a, b)
    broken = solve_many(a.at[..., 0].set(0.0), b)
    assert not np.any(np.isfinite(broken[..., 0]))
    np.testing.assert_array_equal(broken[..., 1], whole[..., 1])


def test_derivatives_in_both_modes():
    a, b = systems(3, 2, 4)
    a = a + 4 * jnp.eye(3)[..., None]

    def size(x, y):
        return jnp.sum(jnp.abs(solve_many(x + 0.5j, y + 0j)) ** 2)

    at = (jnp.real(a), jnp.real(b))
    rng = np.random.default_rng(1)
    along = tuple(jnp.asarray(rng.standard_normal(x.shape)) for x in at)
    forward = jax.jit(lambda x, d: jax.jvp(size, x, d)[1])(at, along)
    slopes = jax.jit(jax.grad(size, argnums=(0, 1)))(*at)
    assert forward == pytest.approx(float(sum(jnp.sum(g * d) for g, d in zip(slopes, along, strict=True))), rel=1e-12)
    evaluate = jax.jit(size)
    up, down = (evaluate(*(x + h * d for x, d in zip(at, along, strict=True))) for h in (1e-6, -1e-6))
    assert forward == pytest.approx(float(up - down) / 2e-6, rel=1e-8)


@pytest.mark.parametrize("n", [1, 2, 7, 16])
def test_one_system_alone_is_solved_as_among_many(n):
    a, b = systems(n, 1, 5)
    alone = jax.vmap(solved_alone)(jnp.moveaxis(a, -1, 0), jnp.moveaxis(b[:, 0], -1, 0))
    np.testing.assert_allclose(alone.T, eliminated(a, b)[:, 0], rtol=1e-12)
    swapped = solved_alone(jnp.asarray([[0.0, 1.0], [2.0, 0.0]]), jnp.asarray([3.0, 4.0]))
    np.testing.assert_array_equal(swapped, [2.0, 3.0])
    assert not np.any(np.isfinite(solved_alone(jnp.zeros((2, 2)), jnp.ones(2))))
