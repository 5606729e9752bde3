"""Exact travel of a sine velocity whose frequency sweeps, linearly or logarithmically.

The travel up to the time τ is, for both sweeps,

    ∫ sin(phase) dτ = F(f₀) - F(f)·cos(phase) - G(f)·sin(phase)

with the frequencies f₀ and f [Hz] at start and end, and the auxiliary functions of the Fresnel integrals (linear) or of
the sine and cosine integrals (logarithmic). Written with them nothing large is subtracted, however slow the sweep: a
sweep that stays at one frequency has F = 1/(2πf) and G = 0.

Source: M. Abramowitz, I. A. Stegun, "Handbook of Mathematical Functions", 1964, eq. 5.2.6 to 5.2.9, 5.2.34 and 5.2.35
(sine and cosine integrals), 7.3.5, 7.3.6, 7.3.9, 7.3.10, 7.3.27 and 7.3.28 (Fresnel integrals).
"""

import math

import jax.numpy as jnp
from jax.scipy.special import fresnel, sici
from jaxtyping import Array, Float

# Arguments up to which the functions themselves are used; above, the asymptotic series are exact to rounding.
_FRESNEL_LIMIT = 6.0
_SICI_LIMIT = 50.0
_TERMS = 13
# 1·3·5···(4m-1) and 1·3·5···(4m+1), with alternating sign.
_FRESNEL_F = tuple((-1) ** m * math.prod(range(1, 4 * m, 2)) for m in range(_TERMS))
_FRESNEL_G = tuple((-1) ** m * math.prod(range(1, 4 * m + 2, 2)) for m in range(_TERMS))
# (2m)! and (2m+1)!, with alternating sign.
_SICI_F = tuple((-1) ** m * math.factorial(2 * m) for m in range(_TERMS))
_SICI_G = tuple((-1) ** m * math.factorial(2 * m + 1) for m in range(_TERMS))


def linear_pair(frequency: Float[Array, ""], rate: Float[Array, ""]) -> tuple[Array, Array]:
    """F and G [s] of a linear sweep: frequency not negative [Hz], its rate of change of either sign [Hz/s].

    Both may not be zero.
    """
    # With x = f·√(2/|rate|): 1/(π·x²) = slowness, f(x)/√(2·|rate|) = F.
    slow = 2 * frequency**2 > _FRESNEL_LIMIT**2 * jnp.abs(rate)
    speed = jnp.abs(jnp.where(slow, 1.0, rate))
    x = jnp.where(slow, 1.0, frequency) * jnp.sqrt(2 / speed)
    s, c = fresnel(x)
    angle = jnp.pi * x**2 / 2
    near_f, near_g = _auxiliary(0.5 - s, 0.5 - c, angle)
    width = 1 / jnp.sqrt(2 * speed)
    slowness = rate / (2 * jnp.pi * jnp.where(slow, frequency, jnp.inf) ** 2)
    far_f, far_g = _asymptotic(slowness, _FRESNEL_F, _FRESNEL_G)
    period = 1 / (2 * jnp.pi * jnp.where(slow, frequency, 1.0))
    return (
        jnp.where(slow, far_f * period, near_f * width),
        jnp.where(slow, far_g * period, jnp.sign(rate) * near_g * width),
    )


def logarithmic_pair(frequency: Float[Array, ""], growth: Float[Array, ""]) -> tuple[Array, Array]:
    """F and G [s] of a logarithmic sweep: positive frequency [Hz], its growth d(ln f)/dt of either sign [1/s]."""
    # With u = 2πf/|growth|: f(u)/|growth| = F.
    slow = 2 * jnp.pi * frequency > _SICI_LIMIT * jnp.abs(growth)
    speed = jnp.abs(jnp.where(slow, 1.0, growth))
    u = 2 * jnp.pi * jnp.where(slow, 1.0, frequency) / speed
    s, c = sici(u)
    near_f, near_g = _auxiliary(jnp.pi / 2 - s, -c, u)
    slowness = growth / (2 * jnp.pi * jnp.where(slow, frequency, jnp.inf))
    far_f, far_g = _asymptotic(slowness, _SICI_F, _SICI_G)
    period = 1 / (2 * jnp.pi * frequency)
    return (
        jnp.where(slow, far_f * period, near_f / speed),
        jnp.where(slow, far_g * period, jnp.sign(growth) * near_g / speed),
    )


def relative_expm1(z: Float[Array, ""]) -> Float[Array, ""]:
    """(exp(z) - 1)/z, smooth through zero."""
    small = jnp.abs(z) < 0.1
    inner = jnp.where(small, z, 0.0)
    series = jnp.zeros_like(z)
    for k in range(10, 0, -1):
        series = series * inner + 1 / math.factorial(k)
    outer = jnp.where(small, 1.0, z)
    return jnp.where(small, series, jnp.expm1(outer) / outer)


def _auxiliary(sine: Array, cosine: Array, angle: Array) -> tuple[Array, Array]:
    """f and g from what the sine-like and the cosine-like integral still lack of their limits."""
    return (
        sine * jnp.cos(angle) - cosine * jnp.sin(angle),
        cosine * jnp.cos(angle) + sine * jnp.sin(angle),
    )


def _asymptotic(slowness: Array, f_terms: tuple[int, ...], g_terms: tuple[int, ...]) -> tuple[Array, Array]:
    """2π·frequency times F and G as power series in the slowness of the sweep: F even, G odd."""
    squared = slowness**2
    f, g = jnp.zeros_like(slowness), jnp.zeros_like(slowness)
    for f_term, g_term in zip(reversed(f_terms), reversed(g_terms), strict=True):
        f, g = f * squared + float(f_term), g * squared + float(g_term)
    return f, slowness * g
