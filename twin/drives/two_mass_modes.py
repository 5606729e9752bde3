"""Resonance, antiresonance and damping of a two-mass drive in closed form, as functions of its parameters."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin.drives.two_mass import TwoMass

# Newton's method doubles the digits with each step, from about two at the start.
_STEPS = 6


class TwoMassModes(NamedTuple):
    """What characterises the vibration of a two-mass drive."""

    resonance: Float[Array, ""]
    """Undamped natural frequency √(k(1/J₁ + 1/J₂))/2π [Hz]."""
    antiresonance: Float[Array, ""]
    """Undamped frequency at which the motor stands still, √(k/J₂)/2π [Hz]."""
    damping_ratio: Float[Array, ""]
    """Damping ratio -Re(s)/|s| of the vibration's pole s, with the friction of both sides."""
    peak: Float[Array, ""]
    """Where the motor's angle responds most to its torque, near the resonance [Hz]."""
    dip: Float[Array, ""]
    """Where the motor's angle responds least to its torque, near the antiresonance [Hz]."""


def two_mass_modes(drive: TwoMass, velocity: Float[ArrayLike, ""] = 0.0) -> TwoMassModes:
    """Resonance, antiresonance, damping ratio, peak and dip of a lightly damped drive; differentiable, also undamped.

    The damping ratio and the two extrema are the exact ones, by Newton's method from their values at small damping. It
    may miss them where the damping ratio exceeds some 0.3 and there is hardly a peak left.

    Args:
        drive: two-mass drive.
        velocity: speed at which the slope of the friction is taken [rad/s or m/s].

    Raises:
        InputError: if a friction law has memory.
    """
    j1, j2, k, d = drive.motor_inertia, drive.load_inertia, drive.stiffness, drive.damping
    viscous = drive.second_order(velocity).viscous
    c1, c2 = viscous[0, 0], viscous[1, 1]
    b1, b2 = c1 - d, c2 - d
    resonance, antiresonance = jnp.sqrt(k * (1 / j1 + 1 / j2)), jnp.sqrt(k / j2)
    # det(Ms² + Cs + K) = s(a₃s³ + a₂s² + a₁s + a₀): the rigid body is at s = 0.
    a3, a2, a1, a0 = j1 * j2, j1 * c2 + j2 * c1, (j1 + j2) * k + b1 * b2 + d * (b1 + b2), k * (b1 + b2)
    small = (d * (j1 + j2) ** 2 / (j1 * j2) + b1 * j2 / j1 + b2 * j1 / j2) / (2 * (j1 + j2))
    pole = _root(
        lambda s: ((a3 * s + a2) * s + a1) * s + a0,
        lambda s: (3 * a3 * s + 2 * a2) * s + a1,
        -small + 1j * resonance,
    )

    def stationary(x: Array) -> Array:
        """d/dx of ln(|motor response|²), x = ω², freed of its denominator so that it stays finite without damping."""
        motor, motor_slope = (k - j2 * x) ** 2 + c2**2 * x, -2 * j2 * (k - j2 * x) + c2**2
        real, imaginary = a3 * x - a1, a0 - a2 * x
        common = x * real**2 + imaginary**2
        common_slope = real**2 + 2 * a3 * x * real - 2 * a2 * imaginary
        return motor_slope * x * common - motor * (common + x * common_slope)

    bend = jax.grad(stationary)
    peak, dip = (_root(stationary, bend, start**2) for start in (resonance, antiresonance))
    turn = 2 * jnp.pi
    return TwoMassModes(
        resonance / turn,
        antiresonance / turn,
        -jnp.real(pole) / jnp.abs(pole),
        jnp.sqrt(peak) / turn,
        jnp.sqrt(dip) / turn,
    )


def _root(function: Callable[[Array], Array], slope: Callable[[Array], Array], start: Array) -> Array:
    """Root of a function by Newton's method; the last step carries the exact derivative, the others none."""
    root = start
    for _ in range(_STEPS):
        root = jax.lax.stop_gradient(root)
        root = root - function(root) / slope(root)
    return root
