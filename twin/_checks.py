"""Checks of input at the edge: one clear error that names the thing, the value seen, what was expected and the cure."""

from typing import Any

import jax
import jax.core
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from twin._input_error import InputError


def require_x64() -> None:
    """Raise unless JAX runs in double precision.

    Raises:
        InputError: if 64-bit mode is off.
    """
    if not jax.config.jax_enable_x64:  # pyright: ignore[reportAttributeAccessIssue]
        raise InputError(
            "drivetwin needs double precision, but JAX's 64-bit mode is off: stiffnesses in N/m lose their last digits "
            'in float32. Call jax.config.update("jax_enable_x64", True) before the first array is made.'
        )


def is_concrete(value: object) -> bool:
    """Whether a value can be looked at now, that is, whether it is not being traced by JAX."""
    return not isinstance(value, jax.core.Tracer)


def as_scalar(value: Any) -> Float[Array, ""]:
    """A number as a double-precision scalar array; the converter of every scalar parameter field."""
    require_x64()
    if not isinstance(value, jax.Array | np.ndarray | np.generic | float | int):
        return value  # a placeholder put there by a tree transformation
    return jnp.asarray(value, dtype=jnp.float64)


def as_array(value: Any) -> Float[Array, "..."]:
    """Numbers as a double-precision array; the converter of every array parameter field."""
    require_x64()
    if not isinstance(value, jax.Array | np.ndarray | np.generic | float | int | list | tuple):
        return value  # a placeholder put there by a tree transformation
    return jnp.asarray(value, dtype=jnp.float64)


def single_number(name: str, value: Any) -> None:
    """Raise where a text, a list or an array stands for a single number. Placeholders of tree transformations pass."""
    if isinstance(value, str) or (not _unreadable(value) and np.ndim(value) > 0):
        seen = repr(value) if isinstance(value, str) else f"an array of shape {np.shape(value)}"
        raise InputError(f"{name} must be a single number in SI units, but is {seen}. Map over several by jax.vmap.")


def finite(name: str, value: ArrayLike, unit: str = "") -> None:
    """Raise unless every entry is finite. Traced values pass: in a batch a bad sample is marked, not raised."""
    if _unreadable(value):
        return
    array = np.asarray(value)
    if not np.all(np.isfinite(array)):
        bad = np.flatnonzero(~np.isfinite(array.ravel()))
        raise InputError(
            f"{name} must be finite{_of(unit)}, but {bad.size} of {array.size} entries are NaN or infinite "
            f"(first at index {bad[0]}). Remove or repair them before use."
        )


def positive(name: str, value: ArrayLike, unit: str = "") -> None:
    """Raise unless every entry is finite and above zero. Traced values pass."""
    if _unreadable(value):
        return
    finite(name, value, unit)
    if not np.all(np.asarray(value) > 0):
        raise InputError(f"{name} must be positive{_of(unit)}, but is {_show(value)}. Check its sign and its unit.")


def above_zero(name: str, value: ArrayLike, unit: str = "") -> None:
    """Raise unless every entry is above zero; infinity passes, as for a limit that is not there. Traced values pass."""
    if _unreadable(value):
        return
    if not np.all(np.asarray(value) > 0):
        raise InputError(f"{name} must be above zero{_of(unit)}, but is {_show(value)}. Use infinity for no limit.")


def not_negative(name: str, value: ArrayLike, unit: str = "") -> None:
    """Raise unless every entry is finite and at least zero. Traced values pass."""
    if _unreadable(value):
        return
    finite(name, value, unit)
    if not np.all(np.asarray(value) >= 0):
        raise InputError(f"{name} must not be negative{_of(unit)}, but is {_show(value)}. Check its sign and its unit.")


def increasing(name: str, value: ArrayLike, unit: str = "") -> None:
    """Raise unless the entries of a vector are finite and strictly increasing. Traced values pass."""
    if _unreadable(value):
        return
    finite(name, value, unit)
    steps = np.diff(np.asarray(value))
    if not np.all(steps > 0):
        index = int(np.flatnonzero(steps <= 0)[0])
        raise InputError(
            f"{name} must increase strictly, but does not at index {index + 1} "
            f"({np.asarray(value)[index]:g} is followed by {np.asarray(value)[index + 1]:g}{_of(unit)}). "
            "Sort the samples and drop repeated ones."
        )


def _unreadable(value: object) -> bool:
    if not is_concrete(value):
        return True
    # Tree transformations put placeholders (None, object(), ShapeDtypeStruct) where arrays were.
    return not isinstance(value, jax.Array | np.ndarray | np.generic | float | int | list | tuple)


def _of(unit: str) -> str:
    return f" [{unit}]" if unit else ""


def _show(value: ArrayLike) -> str:
    array = np.asarray(value)
    return f"{array:g}" if array.ndim == 0 else np.array2string(array, threshold=6, precision=4)
