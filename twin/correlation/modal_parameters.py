"""Differences of natural frequencies and damping ratios, and the eigenvalue that both make."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Complex, Float

from twin._checks import InputError, finite, is_concrete, not_negative, require_x64


def eigenvalue(frequency: Float[ArrayLike, "..."], damping_ratio: Float[ArrayLike, "..."]) -> Complex[Array, "..."]:
    """Eigenvalue λ = -ζω + jω√(1-ζ²) of an oscillating mode, ω = 2πf.

    The two are broadcast: frequencies (simulated, 1) with the damping ratios (reference,) make the eigenvalues
    (simulated, reference) that `macxp` takes where the simulated modes have no damping of their own.

    Args:
        frequency: undamped natural frequency f = |λ|/2π [Hz].
        damping_ratio: damping ratio ζ [-], below 1.

    Returns:
        λ [rad/s]; NaN for a traced damping ratio of 1 or more.

    Raises:
        InputError: 64-bit mode off, a negative or non-finite value, a damping ratio of 1 or more.
    """
    require_x64()
    not_negative("frequency", frequency, "Hz")
    not_negative("damping_ratio", damping_ratio, "-")
    ratio = jnp.asarray(damping_ratio, dtype=jnp.float64)
    if is_concrete(ratio) and np.any(np.asarray(ratio) >= 1):
        raise InputError(
            f"damping_ratio must be below 1 [-], but reaches {np.max(np.asarray(ratio)):g}: overdamped motion has two "
            "real eigenvalues instead. Leave such modes out, or give the eigenvalues themselves."
        )
    return marked_eigenvalue(jnp.asarray(frequency, dtype=jnp.float64), ratio)


def marked_eigenvalue(frequency: Float[Array, "..."], ratio: Float[Array, "..."]) -> Complex[Array, "..."]:
    """`eigenvalue` without its checks: what has none is NaN.

    Args:
        frequency: f [Hz].
        ratio: ζ [-].
    """
    omega = 2 * jnp.pi * frequency
    oscillating = jnp.abs(ratio) < 1
    root = jnp.where(oscillating, jnp.sqrt(1 - jnp.where(oscillating, ratio, 0.0) ** 2), jnp.nan)
    return -ratio * omega + 1j * omega * root


def nfd(frequency: Float[ArrayLike, "..."], reference: Float[ArrayLike, "..."]) -> Float[Array, "..."]:
    """Natural frequency difference (f - f_ref)/f_ref [-], with its sign.

    Args:
        frequency: natural frequencies of paired modes [Hz]; any shapes that broadcast, (simulated, 1) for all pairs.
        reference: those of the reference [Hz].

    Returns:
        Relative differences; NaN where the reference is zero, as that of a rigid-body mode.

    Raises:
        InputError: 64-bit mode off, a value that is not finite, shapes that do not go together.
    """
    return _relative("frequency", frequency, reference, "Hz")


def ndd(damping_ratio: Float[ArrayLike, "..."], reference: Float[ArrayLike, "..."]) -> Float[Array, "..."]:
    """Natural damping difference (ζ - ζ_ref)/ζ_ref [-], with its sign.

    Args:
        damping_ratio: damping ratios of paired modes [-]; any shapes that broadcast, (simulated, 1) for all pairs.
        reference: those of the reference [-].

    Returns:
        Relative differences; NaN where the reference has no damping.

    Raises:
        InputError: as `nfd`.

    Source: root of eq. 5 of J. Ellinger, M. F. Zaeh, Machines 10 (2022) 535.
    """
    return _relative("damping_ratio", damping_ratio, reference, "-")


def ndd_squared(damping_ratio: Float[ArrayLike, "..."], reference: Float[ArrayLike, "..."]) -> Float[Array, "..."]:
    """Squared natural damping difference NDD² [-], smooth also where both are equal.

    Args:
        damping_ratio: as `ndd`.
        reference: as `ndd`.

    Returns:
        NDD².

    Raises:
        InputError: as `nfd`.

    Source: eq. 5 of the paper that `ndd` names.
    """
    return ndd(damping_ratio, reference) ** 2


def _relative(name: str, value: ArrayLike, reference: ArrayLike, unit: str) -> Array:
    require_x64()
    finite(name, value, unit)
    finite("reference", reference, unit)
    x, x_ref = jnp.asarray(value, dtype=jnp.float64), jnp.asarray(reference, dtype=jnp.float64)
    try:
        np.broadcast_shapes(x.shape, x_ref.shape)
    except ValueError:
        raise InputError(
            f"{name} has shape {x.shape}, but reference has {x_ref.shape}. Pair the modes first (`pair_modes`), so "
            "that there is one value for each reference mode."
        ) from None
    defined = x_ref != 0
    safe = jnp.where(defined, x_ref, 1.0)
    return jnp.where(defined, (x - safe) / safe, jnp.nan)
