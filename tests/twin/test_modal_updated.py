"""One mode after a change of a few springs, against all modes of the changed structure."""

import jax
import jax.numpy as jnp
import numpy as np

from twin.modal.updated import Shifted, updated_mode

RNG = np.random.default_rng(0)
EIGENVALUES = np.sort(RNG.uniform(1e3, 1e6, 20))
VECTORS = RNG.normal(size=(20, 4))
CHANGE = np.array([2e3, -50.0, 0.0, 3e4])
K = np.diag(EIGENVALUES) + (VECTORS * CHANGE) @ VECTORS.T


def test_a_mixture_of_modes_is_told_apart_by_the_eigenvalue_to_begin_near():
    values, shapes = np.linalg.eigh(K)
    mixture = shapes @ np.ones(20)
    for i in range(20):
        near = jnp.asarray(values[i] * 1.0001)
        found = jax.jit(updated_mode)(
            jnp.asarray(EIGENVALUES), jnp.asarray(VECTORS), jnp.asarray(CHANGE), jnp.asarray(mixture), near
        )
        np.testing.assert_allclose(found.eigenvalue, values[i], rtol=1e-12)
        np.testing.assert_allclose(found.shape, shapes[:, i], atol=1e-8)
        assert found.error < 1e-9


def test_a_shifted_system_is_solved():
    right = RNG.normal(size=20)
    found = Shifted.of(jnp.asarray(EIGENVALUES), jnp.asarray(VECTORS), jnp.asarray(CHANGE), jnp.asarray(2.5e5))
    np.testing.assert_allclose(
        found.solve(jnp.asarray(right)), np.linalg.solve(K - 2.5e5 * np.eye(20), right), rtol=1e-8
    )
