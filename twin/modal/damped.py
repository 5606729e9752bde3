"""Damped modes of a second-order system: poles and complex shapes."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Complex, Float

from twin._checks import require_x64
from twin._small_systems import solve_many
from twin.linear import SecondOrder
from twin.modal._eigen import generalised_eigh, is_zero
from twin.modal.undamped import check_matrices

# A double pole at zero, that of a rigid body, comes out of the eigenvalue solver split by the root of its precision.
_REAL = 1e-7
# Newton steps on each eigenpair: the first carries first derivatives, the second those of second order.
_STEPS = 2


class DampedModes(eqx.Module):
    """Modes of M·ẍ + C·ẋ + (K + jD)·x = 0 with any damping, ascending in |s|, one of each pair of conjugate poles.

    Rigid-body modes and overdamped motion have real poles, of which the slower ones fill the places that oscillating
    modes leave. They carry no derivative; a pole at zero has frequency and damping ratio zero.
    """

    frequency: Float[Array, "modes"]
    """|s|/2π [Hz]."""
    damping_ratio: Float[Array, "modes"]
    """-Re(s)/|s| [-]."""
    poles: Complex[Array, "modes"]
    """Poles s, Im(s) >= 0 [rad/s]."""
    shapes: Complex[Array, "dofs modes"]
    """Shapes ψ in the degrees of freedom, ψᵀ(2sM + C)ψ = 2j·Im(s): with proportional damping the real, mass-normalised
    ones. Those of real poles have ψᴴMψ = 1."""
    output_shapes: Complex[Array, "outputs modes"]
    """The same at the outputs P·Ψ, rows named by `outputs`."""
    oscillating: Array
    """Whether the pole has an imaginary part, boolean, one for each mode."""
    outputs: tuple[str, ...] = eqx.field(static=True)
    """Names of the outputs."""


def damped_modes(system: SecondOrder) -> DampedModes:
    """Damped modes of a second-order system; differentiable in both modes where poles are distinct.

    The eigenvalue solver gives the start; Newton's method on (s²M + sC + K + jD)ψ = 0 gives the last digits and the
    derivatives, mode by mode: what happens to one mode, such as the defective pole of a rigid body, leaves the others
    alone.

    Args:
        system: symmetric M (positive definite), C, D and K.

    Returns:
        As many modes as degrees of freedom.

    Raises:
        InputError: as `modes`.
    """
    require_x64()
    check_matrices(system)
    held = jax.lax.stop_gradient(system)
    values, basis = generalised_eigh(held.stiffness, held.mass)
    mass, viscous = (basis.T @ matrix @ basis + 0j for matrix in (system.mass, system.viscous))
    stiffness = basis.T @ (system.stiffness + 1j * system.hysteretic) @ basis

    exact = jnp.where(is_zero(values), 0.0, values)
    poles, shapes, fastest = _solve(exact, *(jax.lax.stop_gradient(m) for m in (viscous, stiffness)))
    real = jnp.imag(poles) <= _REAL * fastest
    zero = jnp.abs(poles) <= _REAL * fastest
    start = jnp.where(zero, 0.0, jnp.where(real, jnp.real(poles) + 0j, poles))
    poles, refined = start, shapes
    for _ in range(_STEPS):
        poles, refined = _newton(mass, viscous, stiffness, poles, refined, shapes, real)

    slope = jnp.einsum("im,ijm,jm->m", refined, _slope(mass, viscous, poles), refined)
    scale = jnp.where(real, 1.0, 2j * jnp.imag(poles) / jnp.where(real, 1.0, slope))
    refined = refined * jnp.sqrt(scale)
    largest = jnp.take_along_axis(refined, jnp.argmax(jnp.abs(refined), axis=0)[None], axis=0)
    refined = jnp.where(jnp.real(largest) < 0, -refined, refined)

    size = jnp.where(zero, 0.0, jnp.abs(jnp.where(zero, 1.0, poles)))
    ratio = jnp.where(zero, 0.0, -jnp.real(poles) / jnp.where(zero, 1.0, size))
    shapes = basis @ refined
    return DampedModes(size / (2 * jnp.pi), ratio, poles, shapes, system.output_map @ shapes, ~real, system.outputs)


def _solve(values: Array, viscous: Array, stiffness: Array) -> tuple[Array, Array, Array]:
    """Poles and shapes in modal coordinates, where the system is nearly diagonal, and the fastest pole's size."""
    n = values.size
    # Off the diagonal K has only its hysteretic part; on it, rounding is taken from the rigid-body modes.
    stiffness = jnp.diag(values) + 1j * jnp.imag(stiffness)
    rate = jnp.sqrt(jnp.max(jnp.abs(values)))
    rate = jnp.where(rate > 0, rate, 1.0)
    upper = jnp.concatenate([jnp.zeros((n, n)), rate * jnp.eye(n)], axis=1) + 0j
    lower = jnp.concatenate([-stiffness / rate, -viscous], axis=1)
    poles, vectors = jax.lax.linalg.eig(jnp.concatenate([upper, lower]), compute_left_eigenvectors=False)
    size, fastest = jnp.abs(poles), jnp.max(jnp.abs(poles))
    oscillating = jnp.imag(poles) > _REAL * fastest
    conjugate = jnp.imag(poles) < -_REAL * fastest
    chosen = jnp.lexsort((size, jnp.where(oscillating, 0, jnp.where(conjugate, 2, 1))))[:n]
    chosen = chosen[jnp.argsort(size[chosen])]
    shapes = vectors[:n, chosen]
    return poles[chosen], shapes / jnp.linalg.norm(shapes, axis=0), fastest


def _newton(
    mass: Array, viscous: Array, stiffness: Array, poles: Array, shapes: Array, start: Array, real: Array
) -> tuple[Array, Array]:
    """One step on each eigenpair, its component along the start held; real poles stay as they are."""
    n = poles.size
    slope = jnp.einsum("ijm,jm->im", _slope(mass, viscous, poles), shapes)
    dynamic = poles**2 * mass[..., None] + poles * viscous[..., None] + stiffness[..., None]
    error = jnp.einsum("ijm,jm->im", dynamic, shapes)
    bordered = jnp.concatenate(
        [
            jnp.concatenate([dynamic, slope[:, None]], axis=1),
            jnp.concatenate([jnp.conj(start)[None], jnp.zeros((1, 1, n))], axis=1),
        ]
    )
    bordered = jnp.where(real, jnp.eye(n + 1)[..., None], bordered)
    right = jnp.where(real, 0.0, jnp.concatenate([error, jnp.zeros((1, n))]))
    step = solve_many(bordered, right[:, None])[:, 0]
    return poles - step[n], shapes - step[:n]


def _slope(mass: Array, viscous: Array, poles: Array) -> Array:
    """Derivative of the dynamic stiffness with the pole, 2sM + C."""
    return 2 * poles * mass[..., None] + viscous[..., None]
