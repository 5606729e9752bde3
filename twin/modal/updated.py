"""One mode of a structure whose springs have changed, without solving the whole eigenproblem again.

A change of a few springs is a change of low rank: K = diag(λ₀) + B·diag(Δk)·Bᵀ in the modes of the structure before it.
Systems with K - μI are then solved by Woodbury's identity in O(n·r² + r³) operations for n modes and r springs, and the
mode wanted by a few steps of Rayleigh-quotient iteration, where all modes together cost O(n³).
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from twin._small_systems import solved_alone

# Each step trebles the digits: from a shape some way off four are enough. At this error the eigenvalue is exact.
_STEPS, _ERROR = 8, 1e-9


class UpdatedMode(eqx.Module):
    """An eigenpair of diag(λ₀) + B·diag(Δk)·Bᵀ."""

    eigenvalue: Float[Array, ""]
    """λ = ω² [1/s²]."""
    shape: Float[Array, "n"]
    """Unit vector φ of its coordinates in the modes before the change; its sign is that of the start."""
    error: Float[Array, ""]
    """‖Kφ - λφ‖/λ [-]: no eigenvalue of K is nearer to λ than this share of it says, if it is not small."""


def updated_mode(
    eigenvalues: Float[Array, "n"],
    vectors: Float[Array, "n springs"],
    change: Float[Array, "springs"],
    start: Float[Array, "n"],
    near: Float[Array, ""] | None = None,
) -> UpdatedMode:
    """The mode that Rayleigh-quotient iteration finds from a start; differentiable forward in all but the start.

    It is the mode most like the start in nearly all cases, but not by necessity: where the start is a mixture of modes
    it may be a neighbour. Callers who must know compare with all modes at the end.

    Args:
        eigenvalues: λ₀ of the structure before the change [1/s²].
        vectors: of each spring its stretch in each of these modes, mass-normalised, B.
        change: of each spring the change of its stiffness Δk [N/m].
        start: coordinates in these modes of a shape to begin with; need not be normalised.
        near: eigenvalue to begin near [1/s²]. If given, the first step picks, from a start that is a mixture of modes,
            those that are near to it; if not, or if it is NaN, it begins with the Rayleigh quotient of the start.

    Returns:
        The eigenpair. Derivatives are those of a distinct eigenvalue.
    """
    start = jax.lax.stop_gradient(start)
    if near is not None:
        start = _picked(eigenvalues, vectors, change, start, near)
    value, shape = _eigenpair(eigenvalues, vectors, change, start)
    rest = _times(eigenvalues, vectors, change, shape) - value * shape
    return UpdatedMode(value, shape, jax.lax.stop_gradient(jnp.linalg.norm(rest) / jnp.abs(value)))


def _picked(eigenvalues: Array, vectors: Array, change: Array, start: Array, near: Array) -> Array:
    picked = Shifted.of(eigenvalues, vectors, change, near).solve(start)
    usable = jnp.all(jnp.isfinite(picked)) & jnp.any(picked != 0)
    # The sign of a mode is that of its part of the start.
    return jax.lax.stop_gradient(jnp.where(usable, jnp.where(picked @ start < 0, -picked, picked), start))


@jax.custom_jvp
def _eigenpair(eigenvalues: Array, vectors: Array, change: Array, start: Array) -> tuple[Array, Array]:
    def judged(shape: Array) -> tuple[Array, Array, Array]:
        moved = _times(eigenvalues, vectors, change, shape)
        value = shape @ moved
        return value, shape, jnp.linalg.norm(moved - value * shape) / jnp.abs(value)

    def step(carry: tuple) -> tuple:
        count, value, shape, _ = carry
        # Exactly at an eigenvalue there is no solution: step aside by rounding.
        solved = Shifted.of(eigenvalues, vectors, change, value * (1 + 1e-13) + 1e-300).solve(shape)
        usable = jnp.all(jnp.isfinite(solved)) & jnp.any(solved != 0)
        solved = jnp.where(usable, solved / jnp.linalg.norm(solved), shape)
        return count + 1, *judged(solved)

    def unfinished(carry: tuple) -> Array:
        count, _, _, error = carry
        return (count < _STEPS) & (error > _ERROR)

    begun = (jnp.asarray(0), *judged(start / jnp.linalg.norm(start)))
    _, value, found, _ = jax.lax.while_loop(unfinished, step, begun)
    return value, jnp.where(found @ start < 0, -found, found)


@_eigenpair.defjvp
def _eigenpair_jvp(primals: tuple, tangents: tuple) -> tuple[tuple, tuple]:
    eigenvalues, vectors, change, start = primals
    d_eigenvalues, d_vectors, d_change, _ = tangents
    value, shape = _eigenpair(eigenvalues, vectors, change, start)
    stretch = shape @ vectors
    pushed = d_eigenvalues * shape + vectors @ (d_change * stretch)
    pushed = pushed + d_vectors @ (change * stretch) + vectors @ (change * (shape @ d_vectors))
    d_value = shape @ pushed
    right = d_value * shape - pushed
    return (value, shape), (d_value, beside_mode(eigenvalues, vectors, change, value, shape, right))


def beside_mode(
    eigenvalues: Float[Array, "n"],
    vectors: Float[Array, "n springs"],
    change: Float[Array, "springs"],
    value: Float[Array, ""],
    shape: Float[Array, "n"],
    right: Float[Array, "n"],
    *,
    shift: float = 1e-6,
    rounds: int = 3,
) -> Float[Array, "n"]:
    """The solution x of (K - λI)·x = b that is orthogonal to a mode φ, b without its part along φ.

    Derivatives and adjoints of the mode are of this kind. Solved at a small distance from the eigenvalue, which further
    rounds take out again.

    Args:
        eigenvalues: λ₀ of the structure before the change [1/s²].
        vectors: B.
        change: Δk [N/m].
        value: eigenvalue λ of the mode [1/s²], distinct from the others.
        shape: unit vector φ.
        right: b.
        shift: distance from the eigenvalue, as a share of it [-].
        rounds: solutions; the error falls by the distance over the gap to the next eigenvalue with each.
    """
    near = Shifted.of(eigenvalues, vectors, change, value * (1 - shift))
    found = jnp.zeros_like(shape)
    for _ in range(rounds):
        left = right - (_times(eigenvalues, vectors, change, found) - value * found)
        found = found + near.solve(left - shape * (shape @ left))
        found = found - shape * (shape @ found)
    return found


class Shifted(eqx.Module):
    """(diag(λ₀) + B·diag(Δk)·Bᵀ - μI)⁻¹ by Woodbury's identity, ready for one right-hand side."""

    inverse: Float[Array, "n"]
    """1/(λ₀ - μ) [s²]."""
    vectors: Float[Array, "n springs"]
    """B."""
    change: Float[Array, "springs"]
    """Δk [N/m]."""
    small: Float[Array, "springs springs"]
    """I + diag(Δk)·Bᵀ·diag(1/(λ₀ - μ))·B."""

    @classmethod
    def of(
        cls,
        eigenvalues: Float[Array, "n"],
        vectors: Float[Array, "n springs"],
        change: Float[Array, "springs"],
        shift: Float[Array, ""],
    ) -> "Shifted":
        """The system at a shift μ [1/s²].

        Args:
            eigenvalues: λ₀ [1/s²].
            vectors: B.
            change: Δk [N/m].
            shift: μ [1/s²]; the solution grows without bound as it comes near an eigenvalue.
        """
        inverse = 1 / (eigenvalues - shift)
        flexible = vectors.T @ (inverse[:, None] * vectors)
        return cls(inverse, vectors, change, jnp.eye(change.size) + change[:, None] * flexible)

    def solve(self, right: Float[Array, "n"]) -> Float[Array, "n"]:
        """The solution x of (K - μI)·x = b.

        Args:
            right: b.
        """
        moved = self.inverse * right
        forces = solved_alone(self.small, self.change * (moved @ self.vectors))
        return moved - self.inverse * (self.vectors @ forces)


def _times(eigenvalues: Array, vectors: Array, change: Array, shape: Array) -> Array:
    return eigenvalues * shape + vectors @ (change * (shape @ vectors))
