"""Likeness of frequency responses: of their course (FRAC) and of their size (CSF).

Both are sums over an axis. Summed over frequency they compare response by response and give one value for each FRF;
summed over the responses they compare the deflection at one frequency and give one value for each frequency.
"""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Inexact

from twin._checks import InputError, finite, is_concrete, require_x64
from twin.frf import FRF

Axis = int | Sequence[int]


def frac(
    response: FRF | Inexact[ArrayLike, "..."], reference: FRF | Inexact[ArrayLike, "..."], *, axis: Axis = -1
) -> Float[Array, "..."]:
    """Frequency response assurance criterion |Σ H₁*H₂|² / (Σ|H₁|² · Σ|H₂|²).

    1 where one response is a constant times the other: it sees where resonances lie and how wide they are, not how
    large the response is.

    Args:
        response: simulated responses (response, excitation, frequency); an `FRF`, or arrays of any number of axes.
        reference: the reference's. Of two `FRF`s the responses are matched by name, those of the reference.
        axis: axis or axes summed over. -1, the frequency: one value for each FRF (response, excitation). 0: one value
            for each excitation and frequency, then known as cross signature assurance criterion.

    Returns:
        Values between 0 and 1, axes as the input's but for those summed; NaN where a response is zero throughout.

    Raises:
        InputError: 64-bit mode off, shapes, names or frequencies that do not match, an entry that is not finite.

    Source: W. Heylen, S. Lammens, "FRAC: a consistent way of comparing frequency response functions", Identification in
    Engineering Systems, Swansea (1996) 48-57.
    """
    first, second, axes = _checked(response, reference, axis)
    first, second = first / _size(first, axes), second / _size(second, axes)
    own, own_ref = jnp.sum(_squared(first), axis=axes), jnp.sum(_squared(second), axis=axes)
    defined = (own > 0) & (own_ref > 0)
    cross = _squared(jnp.sum(jnp.conj(first) * second, axis=axes))
    return jnp.where(defined, cross / jnp.where(defined, own * own_ref, 1.0), jnp.nan)


def csf(
    response: FRF | Inexact[ArrayLike, "..."], reference: FRF | Inexact[ArrayLike, "..."], *, axis: Axis = -1
) -> Float[Array, "..."]:
    """Cross signature scale factor 2|Σ H₁*H₂| / (Σ|H₁|² + Σ|H₂|²), also called global amplitude criterion.

    1 for equal responses only (but for one phase), 2a/(1 + a²) for a response a times the other: it sees the size, and
    with it the damping. Never above the root of `frac`.

    The literature sums over the responses and gives a value for each frequency (`axis=0`). The default, one value for
    each FRF, is what the tables of Ellinger and Zaeh seem to hold: every CSF in them lies just below the root of the
    FRAC beside it (or is equal but for rounding), as it must when both are sums over the same axis.

    Args:
        response: as `frac`.
        reference: as `frac`.
        axis: as `frac`: -1 for one value for each FRF, 0 for one for each excitation and frequency, (0, 1) for one for
            each frequency.

    Returns:
        Values between 0 and 1, axes as the input's but for those summed; NaN where both responses are zero throughout.

    Raises:
        InputError: as `frac`.

    Source: E. Dascotte, J. Strobbe, "Updating finite element models using FRF correlation functions", Proc. 17th
    International Modal Analysis Conference (1999); tables 2 to 5 of J. Ellinger, M. F. Zaeh, Machines 10 (2022) 535.
    """
    first, second, axes = _checked(response, reference, axis)
    scale = _size(jnp.maximum(jnp.abs(first), jnp.abs(second)), axes)
    first, second = first / scale, second / scale
    total = jnp.sum(_squared(first), axis=axes) + jnp.sum(_squared(second), axis=axes)
    cross = jnp.abs(jnp.sum(jnp.conj(first) * second, axis=axes))
    return jnp.where(total > 0, 2 * cross / jnp.where(total > 0, total, 1.0), jnp.nan)


def _size(values: Array, axes: tuple[int, ...]) -> Array:
    """Largest entry, 1 if that is zero: squares of a receptance in m/N come near the smallest numbers."""
    largest = jax.lax.stop_gradient(jnp.max(jnp.abs(values), axis=axes, keepdims=True))
    return jnp.where(largest > 0, largest, 1.0)


def _squared(values: Array) -> Array:
    return jnp.real(values) ** 2 + jnp.imag(values) ** 2


def _checked(response: FRF | ArrayLike, reference: FRF | ArrayLike, axis: Axis) -> tuple[Array, Array, tuple[int, ...]]:
    require_x64()
    first, second = _values(response, reference)
    for name, array in (("response", first), ("reference", second)):
        if is_concrete(array):
            finite(name, array)
    if first.shape != second.shape or first.ndim == 0:
        raise InputError(
            f"response has shape {first.shape}, but reference has {second.shape}. Compute both at the same responses, "
            "excitations and frequencies."
        )
    axes = tuple(np.atleast_1d(axis).tolist())
    for one in axes:
        if not -first.ndim <= one < first.ndim:
            raise InputError(f"axis is {one}, but the responses have {first.ndim} axes.")
    return first, second, axes


def _values(response: FRF | ArrayLike, reference: FRF | ArrayLike) -> tuple[Array, Array]:
    if not isinstance(response, FRF) or not isinstance(reference, FRF):
        plain = [x.values if isinstance(x, FRF) else jnp.asarray(x) for x in (response, reference)]
        return plain[0], plain[1]
    lines, lines_ref = response.frequency, reference.frequency
    same = lines.shape == lines_ref.shape
    if same and is_concrete(lines) and is_concrete(lines_ref):
        same = np.allclose(lines, lines_ref, rtol=1e-9, atol=0)
    if not same:
        raise InputError(
            f"The responses have different frequencies: {lines.size} and {lines_ref.size} lines. Compute the simulated "
            "response at the reference's."
        )
    for kind, names, wanted in (
        ("output", response.outputs, reference.outputs),
        ("input", response.inputs, reference.inputs),
    ):
        for name in wanted:
            if name not in names:
                raise InputError(f"The response has no {kind} {name!r} of the reference; it has {', '.join(names)}.")
    rows = [response.outputs.index(name) for name in reference.outputs]
    columns = [response.inputs.index(name) for name in reference.inputs]
    return response.values[np.ix_(rows, columns)], reference.values
