"""Undamped modes of a second-order system: frequencies, shapes, modal damping ratios."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from twin._checks import InputError, is_concrete, require_x64
from twin.linear import SecondOrder
from twin.modal._eigen import generalised_eigh, guarded_root


class Modes(eqx.Module):
    """Undamped modes of M·ẍ + C·ẋ + (K + jD)·x = 0, ascending in frequency, with their modal damping ratios.

    A rigid-body mode has frequency zero, and damping ratio zero for want of a definition, both with derivative zero.
    """

    frequency: Float[Array, "modes"]
    """Natural frequencies ω/2π [Hz]."""
    damping_ratio: Float[Array, "modes"]
    """Modal damping ratios ζ = φᵀCφ/(2ω) + φᵀDφ/(2ω²) [-]: exact for proportional damping, else to first order."""
    shapes: Float[Array, "dofs modes"]
    """Mass-normalised shapes Φ in the degrees of freedom, ΦᵀMΦ = I, one mode per column [1/√kg for a displacement]."""
    output_shapes: Float[Array, "outputs modes"]
    """The same at the outputs P·Φ, rows named by `outputs`."""
    eigenvalues: Float[Array, "modes"]
    """Eigenvalues λ = ω² [1/s²]; smooth also where the frequency, a root, is not."""
    mass: Float[Array, "dofs dofs"]
    """Mass matrix M: the measure by which shapes in mixed units are compared."""
    outputs: tuple[str, ...] = eqx.field(static=True)
    """Names of the outputs."""


def modes(system: SecondOrder) -> Modes:
    """Undamped modes of a second-order system, with modal damping ratios; differentiable in both modes.

    Derivatives are finite also at repeated eigenvalues and rigid-body modes. At a repeated eigenvalue they are exact
    for what does not depend on the choice of shapes in its subspace: the mean of the repeated eigenvalues, the
    projector Σφφᵀ. Sorted modes change places where they cross: see `track`.

    Args:
        system: symmetric M (positive definite), C, D and K.

    Returns:
        The modes; a negative eigenvalue, of an unstable system, has frequency NaN.

    Raises:
        InputError: 64-bit mode off, a matrix that is not finite or not symmetric, a mass matrix that is not positive
            definite. In a batch they are not raised; the modes of such a mass matrix are NaN.
    """
    require_x64()
    check_matrices(system)
    values, shapes = generalised_eigh(system.stiffness, system.mass)
    omega = guarded_root(values)
    moving = omega > 0
    safe = jnp.where(moving, omega, 1.0)
    viscous = jnp.einsum("im,ij,jm->m", shapes, system.viscous, shapes)
    hysteretic = jnp.einsum("im,ij,jm->m", shapes, system.hysteretic, shapes)
    ratio = jnp.where(moving, viscous / (2 * safe) + hysteretic / (2 * safe**2), 0.0 * omega)
    return Modes(omega / (2 * jnp.pi), ratio, shapes, system.output_map @ shapes, values, system.mass, system.outputs)


def check_matrices(system: SecondOrder) -> None:
    """Raise unless the matrices make a vibrating system. Traced values pass.

    Args:
        system: system of second order.

    Raises:
        InputError: a matrix that is not finite or not symmetric, a mass matrix that is not positive definite.
    """
    named = {name: getattr(system, name) for name in ("mass", "viscous", "hysteretic", "stiffness")}
    if not all(is_concrete(matrix) for matrix in named.values()):
        return
    for name, value in named.items():
        matrix = np.asarray(value)
        if not np.all(np.isfinite(matrix)):
            raise InputError(f"The {name} matrix has entries that are NaN or infinite. Check the model's parameters.")
        scale = np.sqrt(np.abs(np.outer(np.diag(matrix), np.diag(matrix))))
        if np.any(np.abs(matrix - matrix.T) > 1e-9 * np.maximum(scale, 1e-300)):
            raise InputError(
                f"The {name} matrix is not symmetric, so that its modes are not those of an eigenproblem with real "
                "shapes. Use twin.linear for systems with gyroscopic or follower forces."
            )
    try:
        np.linalg.cholesky(np.asarray(named["mass"]))
    except np.linalg.LinAlgError:
        raise InputError(
            "The mass matrix is not positive definite: every degree of freedom needs a mass. Remove those without one "
            "by static condensation."
        ) from None
