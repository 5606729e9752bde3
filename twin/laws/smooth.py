"""Smooth stand-ins for the sign, the magnitude and powers of the magnitude.

All of them are infinitely differentiable in the value, also at zero, and approach the sharp function as (w/v)² once
|v| is well above the width w. The width has the unit of the value, so that it can be read and chosen: the speed below
which a direction of motion is no longer told from standstill.
"""

import functools
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._powers import natural_logarithm

# Beyond this ratio of value to width the smooth and the sharp function are equal to the last digit, and the squares
# below are not far from overflow.
_SHARP = 1e50


def smooth_sign(value: Float[ArrayLike, "*batch"], width: Float[ArrayLike, ""]) -> Float[Array, "*batch"]:
    """Direction of a value: v / √(v² + w²), odd, from -1 to 1.

    Args:
        value: v, any shape, any unit.
        width: w, positive, in the unit of v. At v = w the result is 1/√2.

    Returns:
        The smooth sign, in the shape of v.
    """
    return _sign(jnp.asarray(value, float), jnp.asarray(width, float))


def smooth_abs(value: Float[ArrayLike, "*batch"], width: Float[ArrayLike, ""]) -> Float[Array, "*batch"]:
    """Magnitude of a value: √(v² + w²), even, never below w.

    It goes with `smooth_sign`: smooth_sign(v) · smooth_abs(v) = v exactly.

    Args:
        value: v, any shape, any unit.
        width: w, positive, in the unit of v; the value at v = 0.

    Returns:
        The smooth magnitude in the unit and shape of v.
    """
    return _magnitude(jnp.asarray(value, float), jnp.asarray(width, float))


def smooth_power(
    value: Float[ArrayLike, "*batch"], width: Float[ArrayLike, ""], exponent: Float[ArrayLike, ""]
) -> Float[Array, "*batch"]:
    """Power of the magnitude |v|^δ, as v² (v² + w²)^(δ/2 - 1): even, zero at v = 0, increasing in |v|.

    The sharp power has an infinite slope at zero for δ < 1 and an infinite curvature for δ < 2; this one has neither.

    Args:
        value: v, any shape, any unit.
        width: w, positive, in the unit of v.
        exponent: δ [-], positive.

    Returns:
        The smooth power in the shape of v.
    """
    return smooth_sign(value, width) ** 2 * positive_power(smooth_abs(value, width), exponent)


def positive_power(base: Float[ArrayLike, "*batch"], exponent: Float[ArrayLike, ""]) -> Float[Array, "*batch"]:
    """Power of a positive number, x^p as exp(p·ln x).

    The compiler calls a library for every single power, but writes out exponentials over whole vectors, and so it does
    this logarithm: in a batch four times as fast, and as accurate as p·ln x, to a few units in the last place for
    moderate powers.

    Args:
        base: x, positive, any shape, any unit.
        exponent: p of any sign [-].

    Returns:
        The power in the shape of x.
    """
    return jnp.exp(exponent * natural_logarithm(base))


def smooth_clip(
    value: Float[ArrayLike, "*batch"], limit: Float[ArrayLike, ""], width: Float[ArrayLike, ""] | None = None
) -> Float[Array, "*batch"]:
    """A value within ±limit: ½·(√((v + L)² + w²) - √((v - L)² + w²)), odd, increasing, never beyond the limit.

    Args:
        value: v, any shape, any unit.
        limit: L, positive and finite, in the unit of v.
        width: w, positive, in the unit of v: how far before the limit the curve begins to bend; a thousandth of the
            limit if not given.

    Returns:
        The limited value in the shape of v.
    """
    v = jnp.asarray(value)
    bend = jnp.asarray(1e-3 * limit if width is None else width)
    # The difference of the two roots without cancellation.
    return jnp.asarray(2 * limit * v) / (smooth_abs(v + limit, bend) + smooth_abs(v - limit, bend))


# Derivatives by rule: those of the guards would be carried along by every sensitivity.


@jax.custom_jvp
def _sign(value: Array, width: Array) -> Array:
    sharp, value_inside, width_inside = _guarded(value, width)
    return jnp.where(sharp, jnp.sign(value), value_inside / jnp.sqrt(value_inside**2 + width_inside**2))


@functools.partial(_sign.defjvp, symbolic_zeros=True)
def _sign_jvp(primals: Any, tangents: Any) -> Any:
    value, width = primals
    sign, magnitude = _sign(value, width), _magnitude(value, width)
    share = width / magnitude
    slopes = (share * share / magnitude, -share * sign / magnitude)
    return sign, _along(slopes, tangents)


@jax.custom_jvp
def _magnitude(value: Array, width: Array) -> Array:
    sharp, value_inside, width_inside = _guarded(value, width)
    return jnp.where(sharp, jnp.abs(value), jnp.sqrt(value_inside**2 + width_inside**2))


@functools.partial(_magnitude.defjvp, symbolic_zeros=True)
def _magnitude_jvp(primals: Any, tangents: Any) -> Any:
    value, width = primals
    magnitude = _magnitude(value, width)
    return magnitude, _along((_sign(value, width), width / magnitude), tangents)


def _along(slopes: tuple[Array, Array], tangents: Any) -> Array:
    """Sum over those arguments that change at all."""
    terms = [
        slope * change
        for slope, change in zip(slopes, tangents, strict=True)
        if not isinstance(change, jax.custom_derivatives.SymbolicZero)
    ]
    return functools.reduce(jnp.add, terms) if terms else jnp.zeros_like(slopes[0])


def _guarded(value: Array, width: Array) -> tuple[Array, Array, Array]:
    # What is not selected must not overflow either: its derivative would be infinity times zero.
    sharp = jnp.abs(value) > _SHARP * width
    return sharp, jnp.where(sharp, 1.0, value), jnp.where(sharp, 1.0, width)
