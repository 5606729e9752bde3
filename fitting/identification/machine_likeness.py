"""How unlike a reference mode a machine's mode is, as a function of a few springs, with its gradient.

All other springs are held, so the machine's modes with the searched springs at some values are solved once; what a
change of the few does to one mode is then found without the others (`twin.modal.updated`).
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from fitting.identification.machine_macxp import macxp_of_one_ratio
from fitting.residuals.residual import AbstractResidual
from twin.modal.updated import beside_mode, updated_mode

# Distance from the eigenvalue at which the adjoint is solved, as a share of it; one round takes it out again.
_SHIFT = 1e-7
# Least 1 - MACXP: its root has a derivative there, and what is below is rounding.
_LEAST = 1e-16
# Error of the eigenpair ‖Kφ - λφ‖/λ up to which it is one.
_ERROR = 1e-6


class PartData(eqx.Module):
    """One problem: a reference mode, and the machine in the modes that it has before its springs are changed."""

    eigenvalues: Float[Array, "n"]
    """λ₀ of the machine before the change [1/s²]."""
    vectors: Float[Array, "n rows"]
    """Stretch of each place of the searched springs in these modes; zero for padding."""
    weight: Float[Array, "rows"]
    """Stiffness that the whole range of a parameter's share stands for [N/m, Nm/rad]."""
    owner: Int[Array, "rows"]
    """Parameter that each place belongs to."""
    base: Float[Array, "parameters"]
    """Shares of the machine before the change [-]."""
    gram: Float[Array, "n n"]
    """ΨᵀΨ of the shapes Ψ of these modes at the outputs."""
    cross: Float[Array, "n"]
    """Ψᵀφ₀ with the reference shape φ₀ of unit length."""
    start: Float[Array, "n"]
    """Shape that the mode is sought from: the reference shape, expanded to these modes, or one of these modes."""
    near: Float[Array, ""]
    """Eigenvalue that the mode is sought near [1/s²]; NaN to go by the shape alone."""
    omega: Float[Array, ""]
    """Angular frequency of the reference mode [rad/s]."""
    ratio: Float[Array, ""]
    """Its damping ratio [-]."""


class Shares(eqx.Module):
    """Searched stiffnesses as shares of the way from their lower to their upper bound."""

    share: Float[Array, "parameters"]
    """0 at the lower bound, 1 at the upper one."""


class Unlikeness(AbstractResidual):
    """Residual √(2(1 - MACXP)), so that half its square is what the paper minimises."""

    data: PartData
    """The problem."""

    def __call__(self, model: Shares) -> Float[Array, "1"]:
        return _residual(model.share, self.data)[None]


def unlikeness(share: Float[Array, "parameters"], data: PartData) -> tuple[Array, Array]:
    """1 - MACXP of the machine's mode that is like the reference mode, and its gradient by one adjoint solution.

    Args:
        share: searched stiffnesses as shares of their ranges.
        data: the problem.

    Returns:
        1 - MACXP, NaN where the iteration found no mode, and its derivatives by the shares.
    """
    change = (share - data.base)[data.owner] * data.weight
    mode = updated_mode(data.eigenvalues, data.vectors, change, data.start, data.near)
    value, shape = mode.eigenvalue, mode.shape
    moved = data.gram @ shape
    length, along = shape @ moved, data.cross @ shape

    def likeness(mac: Array, value: Array) -> Array:
        return macxp_of_one_ratio(mac, jnp.sqrt(value), data.omega, data.ratio)

    mac = along**2 / length
    (per_mac, per_value) = jax.grad(likeness, argnums=(0, 1))(mac, value)
    # ∂MAC/∂φ is orthogonal to φ, for MAC does not depend on its length.
    right = per_mac * 2 * along / length * (data.cross - along / length * moved)
    adjoint = beside_mode(data.eigenvalues, data.vectors, change, value, shape, right, shift=_SHIFT, rounds=2)
    stretch = shape @ data.vectors
    per_row = (per_value * stretch - adjoint @ data.vectors) * stretch * data.weight
    slope = jnp.sum(jnp.where(data.owner[:, None] == jnp.arange(share.size), per_row[:, None], 0.0), axis=0)
    # What is no mode has no likeness: the solver then takes a shorter step.
    return jnp.where(mode.error < _ERROR, 1 - likeness(mac, value), jnp.nan), -slope


def _root(value: Array) -> Array:
    return jnp.sqrt(2 * jnp.maximum(value, _LEAST))


@jax.custom_jvp
def _residual(share: Array, data: PartData) -> Array:
    return _root(unlikeness(share, data)[0])


@_residual.defjvp
def _residual_jvp(primals: tuple, tangents: tuple) -> tuple[Array, Array]:
    (share, data), (d_share, _) = primals, tangents
    value, slope = unlikeness(share, data)
    residual = _root(value)
    return residual, slope @ d_share / residual
