"""Likeness of mode shapes, alone (MAC) and with their eigenvalues (MACXP)."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Inexact

from twin._checks import InputError, finite, is_concrete, require_x64

_Parts = tuple[Array, ...]
"""Real part of shapes, and imaginary part if they have one."""


def mac(shapes: Inexact[ArrayLike, "..."], reference: Inexact[ArrayLike, "rows ..."]) -> Float[Array, "..."]:
    """Modal assurance criterion |φ₁ᴴφ₂|² / (φ₁ᴴφ₁ · φ₂ᴴφ₂): squared cosine of shapes, whatever their scale and phase.

    All pairs of two matrices, or one pair of two vectors; pairs in step by `jax.vmap(mac, (1, 1))`.

    Args:
        shapes: one shape (rows,) or one per column (rows, modes), real or complex.
        reference: the same for the reference, in the same rows.

    Returns:
        1 for the same shape, 0 for orthogonal ones; NaN for a shape that is zero. (modes, references), without the axis
        of an argument that is one shape.

    Raises:
        InputError: 64-bit mode off, different numbers of rows, an entry that is not finite.

    Source: R. J. Allemang, D. L. Brown, "A correlation coefficient for modal vector analysis", Proc. 1st International
    Modal Analysis Conference (1982) 110-116.
    """
    first, second = _checked(shapes, reference)
    one, other = _unit(_columns(first)), _unit(_columns(second))
    defined = _defined(one)[:, None] & _defined(other)[None, :]
    return jnp.where(defined, _products(one, other)[0], jnp.nan).reshape(first.shape[1:] + second.shape[1:])


def macxp(
    shapes: Inexact[ArrayLike, "..."],
    eigenvalues: Inexact[ArrayLike, "..."],
    reference: Inexact[ArrayLike, "..."],
    reference_eigenvalues: Inexact[ArrayLike, "..."],
) -> Float[Array, "..."]:
    """Extended modal assurance criterion: likeness of two modes as free decays φ·e^(λt), shape and eigenvalue together.

    The squared cosine between the decays, at the phases at which it is largest: 1 for the same shape and eigenvalue.
    For the same shape and little damping it halves where the frequencies differ by about 2ζ, so that modes of like
    shapes are told apart by their frequencies.

    Without damping a mode never decays, and the criterion is singular: from undamped modes make eigenvalues with the
    reference's damping ratios (`eigenvalue`), which may differ from pair to pair.

    Differentiable. Where complex shapes make φ₁ᵀφ₂ or φ₁ᴴφ₂ zero, but not both, it has a kink; the derivative is then
    the one with that term held.

    Args:
        shapes: one shape (rows,) or one per column (rows, modes), real or complex.
        eigenvalues: λ of each [rad/s], Re(λ) < 0: (modes,), or for each pair (modes, references); without the axis of
            an argument that is one shape.
        reference: shapes of the reference, in the same rows.
        reference_eigenvalues: λ of each [rad/s], (references,).

    Returns:
        Values between 0 and 1 (modes, references), without the axis of an argument that is one shape. NaN for a shape
        that is zero, and for a traced eigenvalue without damping.

    Raises:
        InputError: 64-bit mode off, different numbers of rows, eigenvalues of other shapes, an entry that is not
            finite, an eigenvalue without damping.

    Source: P. Vacher, B. Jacquier, A. Bucharles, "Extensions of the MAC criterion to complex modes", Proc. ISMA (2010)
    2713-2726; eq. 4 of J. Ellinger, M. F. Zaeh, Machines 10 (2022) 535.
    """
    first, second = _checked(shapes, reference)
    poles = _decaying("eigenvalues", eigenvalues)
    poles_ref = _decaying("reference_eigenvalues", reference_eigenvalues)
    rows, columns = first.shape[1:], second.shape[1:]
    if poles.shape not in (rows, rows + columns) or poles_ref.shape != columns:
        raise InputError(
            f"eigenvalues have shape {poles.shape} and {poles_ref.shape} (reference), but the shapes are {first.shape} "
            f"and {second.shape}. Give one eigenvalue for each mode, {rows} and {columns}, or of the first for each "
            f"pair, {rows + columns}."
        )
    by_pair = poles.shape == rows + columns and columns != ()
    one, other = _columns(first), _columns(second)
    value = marked_macxp(
        one, poles.reshape((one.shape[1], -1 if by_pair else 1)), other, poles_ref.reshape((1, other.shape[1]))
    )
    return value.reshape(rows + columns)


def marked_macxp(
    shapes: Inexact[Array, "rows modes"],
    poles: Inexact[Array, "modes #references"],
    reference: Inexact[Array, "rows references"],
    poles_ref: Inexact[Array, "1 references"],
) -> Float[Array, "modes references"]:
    """`macxp` of all pairs without its checks: what has no damping is NaN, and does not touch the derivative of others.

    Args:
        shapes: one shape per column.
        poles: eigenvalues λ [rad/s], the same for all references, or for each pair.
        reference: one shape per column.
        poles_ref: eigenvalues of the reference [rad/s].
    """
    one, other = _unit(shapes), _unit(reference)
    damped, damped_ref = jnp.real(poles) < 0, jnp.real(poles_ref) < 0
    poles, poles_ref = jnp.where(damped, poles, -1.0), jnp.where(damped_ref, poles_ref, -1.0)
    real, real_ref = jnp.real(poles), jnp.real(poles_ref)
    imag, imag_ref = jnp.imag(poles), jnp.imag(poles_ref)
    conjugate = (real + real_ref) ** 2 + (imag - imag_ref) ** 2  # |λ₁* + λ₂|²
    plain = (real + real_ref) ** 2 + (imag + imag_ref) ** 2  # |λ₁ + λ₂|²
    hermitian, straight = _products(one, other)
    if hermitian is straight:  # real shapes: without a root of them, which would hide the second derivative at zero
        cross = hermitian * (1 / conjugate + 1 / plain + 2 / jnp.sqrt(conjugate * plain))
    else:  # the square of the sum in eq. 4, with a root of the product of both terms only
        cross = hermitian / conjugate + straight / plain + 2 * _root(hermitian * straight / (conjugate * plain))
    value = cross / (_own(one, real, imag, 1) * _own(other, real_ref, imag_ref, 0))  # eq. 4
    defined = damped & damped_ref & _defined(one)[:, None] & _defined(other)[None, :]
    return jnp.where(defined, value, jnp.nan)


def _own(unit: _Parts, real: Array, imag: Array, axis: int) -> Array:
    """φᴴφ/(2|Re λ|) + |φᵀφ|/(2|λ|) of unit shapes."""
    straight = 1.0
    if len(unit) == 2:  # 1 for a standing wave, 0 for a travelling one
        difference, mixed = jnp.sum(unit[0] ** 2 - unit[1] ** 2, axis=0), 2 * jnp.sum(unit[0] * unit[1], axis=0)
        straight = jnp.expand_dims(_root(difference**2 + mixed**2), axis)
    return 1 / (-2 * real) + straight / (2 * jnp.sqrt(real**2 + imag**2))


def _products(one: _Parts, other: _Parts) -> tuple[Array, Array]:
    """|φ₁ᴴφ₂|² and |φ₁ᵀφ₂|² of all pairs, from one real product; the same array twice for real shapes."""
    cross = jnp.concatenate(one, axis=1).T @ jnp.concatenate(other, axis=1)
    n, m = one[0].shape[1], other[0].shape[1]
    squares = cross**2
    if len(one) + len(other) == 2:
        return squares, squares
    if len(other) == 1:
        both = squares[:n] + squares[n:]
        return both, both
    if len(one) == 1:
        both = squares[:, :m] + squares[:, m:]
        return both, both
    rr, ri, ir, ii = cross[:n, :m], cross[:n, m:], cross[n:, :m], cross[n:, m:]
    return (rr + ii) ** 2 + (ri - ir) ** 2, (rr - ii) ** 2 + (ri + ir) ** 2


def _unit(shapes: Array) -> _Parts:
    """Real and imaginary part of shapes of unit length; one that is zero stays so, with finite derivatives."""
    parts = (jnp.real(shapes), jnp.imag(shapes)) if jnp.iscomplexobj(shapes) else (shapes,)
    # First by the largest entry, for squares of very small or large entries leave the range of numbers.
    largest = jax.lax.stop_gradient(jnp.max(jnp.stack([jnp.max(jnp.abs(x), axis=0) for x in parts]), axis=0))
    parts = tuple(x / jnp.where(largest > 0, largest, 1.0) for x in parts)
    length = sum(jnp.sum(x**2, axis=0) for x in parts)
    return tuple(x / jnp.sqrt(jnp.where(length > 0, length, 1.0)) for x in parts)


def _defined(unit: _Parts) -> Array:
    return jnp.any(jnp.concatenate(unit) != 0, axis=0)


def _root(square: Array) -> Array:
    """Square root with derivative zero at zero."""
    return jnp.where(square > 0, jnp.sqrt(jnp.where(square > 0, square, 1.0)), 0.0)


def _columns(shapes: Array) -> Array:
    return shapes.reshape((shapes.shape[0], -1))


def _checked(shapes: ArrayLike, reference: ArrayLike) -> tuple[Array, Array]:
    require_x64()
    first, second = jnp.asarray(shapes), jnp.asarray(reference)
    for name, array in (("shapes", first), ("reference", second)):
        if array.ndim not in (1, 2) or array.size == 0:
            raise InputError(f"{name} must be one shape (rows,) or several (rows, modes), but is {array.shape}.")
        finite(name, array)
    if first.shape[0] != second.shape[0]:
        raise InputError(
            f"shapes have {first.shape[0]} rows, but the reference has {second.shape[0]}. Take the rows measured in "
            "both, in one order."
        )
    return first, second


def _decaying(name: str, eigenvalues: ArrayLike) -> Array:
    array = jnp.asarray(eigenvalues)
    if is_concrete(array):
        finite(name, array, "rad/s")
        growing = np.flatnonzero(np.real(np.asarray(array)).ravel() >= 0)
        if growing.size:
            raise InputError(
                f"{name} must have negative real parts [rad/s], but {growing.size} of {array.size} have none (first at "
                f"index {growing[0]}): MACXP is singular without damping. Give the modes the reference's damping "
                "ratios with `eigenvalue`, and leave rigid-body modes out."
            )
    return array
