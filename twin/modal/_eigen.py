"""The symmetric eigenproblem K·φ = λ·M·φ, with derivatives that stay finite where eigenvalues are repeated.

JAX differentiates `eigh` by dividing by the gaps between eigenvalues: one repeated pair makes every eigenvector's
gradient NaN, those of distinct modes and of the pair's subspace included (trap 17). Here the eigenvectors of a repeated
eigenvalue are not turned into each other, which is what cancels in everything that has a derivative at all.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

REPEATED = 1e-11
"""Eigenvalues count as repeated, and as zero, within this share of the largest one: LAPACK errs by 1e-16 of it for each
degree of freedom."""


@jax.custom_jvp
def generalised_eigh(
    stiffness: Float[Array, "n n"], mass: Float[Array, "n n"]
) -> tuple[Float[Array, "n"], Float[Array, "n n"]]:
    """Eigenvalues, ascending, and mass-normalised eigenvectors of K·φ = λ·M·φ.

    First derivatives are exact for distinct eigenvalues and their vectors, and at a repeated eigenvalue for whatever
    does not depend on the choice of vectors in its subspace: the mean of the repeated eigenvalues, the projector on the
    subspace, symmetric functions of both. Second derivatives are exact for distinct eigenvalues, and for the mean of
    repeated ones.

    Args:
        stiffness: K, symmetric.
        mass: M, symmetric and positive definite.

    Returns:
        λ, and Φ with ΦᵀMΦ = I, its columns the vectors, the largest entry of each, weighted by mass, positive; NaN
        where M is not positive definite.

    Source: R. L. Fox, M. P. Kapoor, "Rates of change of eigenvalues and eigenvectors", AIAA Journal 6 (1968) 2426-2429.
    """
    root = jnp.linalg.cholesky(mass)
    half = jax.scipy.linalg.solve_triangular(root, stiffness, lower=True)
    reduced = jax.scipy.linalg.solve_triangular(root, half.T, lower=True)
    values, vectors = jnp.linalg.eigh(reduced)
    largest = jnp.take_along_axis(vectors, jnp.argmax(jnp.abs(vectors), axis=0)[None], axis=0)
    vectors = jnp.where(largest < 0, -vectors, vectors)
    return values, jax.scipy.linalg.solve_triangular(root, vectors, lower=True, trans="T")


@generalised_eigh.defjvp
def _generalised_eigh_jvp(primals: tuple, tangents: tuple) -> tuple[tuple, tuple]:
    (stiffness, mass), (d_stiffness, d_mass) = primals, tangents
    values, vectors = generalised_eigh(stiffness, mass)
    d_k, d_m = vectors.T @ _symmetric(d_stiffness) @ vectors, vectors.T @ _symmetric(d_mass) @ vectors
    together = repeated(values)
    gap = jnp.where(together, 1.0, values[None, :] - values[:, None])
    # Between the vectors of one subspace only the normalisation acts: half of dM, shared evenly.
    turn = jnp.where(together, -0.5 * d_m, (d_k - d_m * values[None, :]) / gap)
    # ΦᵀKΦ is diag(λ), but its derivative is full in a repeated subspace, which second derivatives need.
    own = vectors.T @ stiffness @ vectors
    return (values, vectors), (jnp.diagonal(d_k) - jnp.sum(d_m * own, axis=0), vectors @ turn)


def repeated(values: Float[Array, "n"]) -> Array:
    """Which pairs of eigenvalues count as repeated, a boolean matrix with a true diagonal.

    Args:
        values: eigenvalues.
    """
    return jnp.abs(values[None, :] - values[:, None]) <= REPEATED * jnp.max(jnp.abs(values))


def guarded_root(values: Float[Array, "n"]) -> Float[Array, "n"]:
    """Square roots of eigenvalues: 0 with derivative 0 for one that is zero by rounding, NaN for one well below zero.

    Args:
        values: eigenvalues λ, of which a rigid-body mode's is zero.

    Returns:
        √λ.
    """
    zero = is_zero(values)
    return jnp.where(zero, 0.0, jnp.sqrt(jnp.where(zero, 1.0, values)))


def is_zero(values: Float[Array, "n"]) -> Array:
    """Which eigenvalues are zero but for rounding, a boolean vector.

    Args:
        values: eigenvalues.
    """
    return jnp.abs(values) <= REPEATED * jnp.max(jnp.abs(values))


def _symmetric(matrix: Array) -> Array:
    return 0.5 * (matrix + matrix.T)
