"""MACXP of two real modes that are given one damping ratio, in closed form, and its derivative."""

from typing import Any


def macxp_of_one_ratio(mac: Any, omega: Any, omega_ref: Any, ratio: Any) -> Any:
    """MACXP of real shapes, both modes with the damping ratio of the reference (assumption A1).

    With λ = ω(-ζ + j√(1-ζ²)) for both, eq. 4 becomes MAC·4ζ²ωω₀/(1+ζ)²·(1/|λ* + λ₀| + 1/(ω + ω₀))²: the likeness of
    the shapes times a bell over the ratio of the frequencies, half as wide as ζ. Written for JAX and for NumPy, all
    arguments broadcast.

    Args:
        mac: modal assurance criterion of the shapes [-].
        omega: angular natural frequency ω [rad/s].
        omega_ref: that of the reference ω₀ [rad/s].
        ratio: damping ratio ζ of both [-], above zero.

    Returns:
        MACXP [-].

    Source: eq. 4 of J. Ellinger, M. F. Zaeh, Machines 10 (2022) 535.
    """
    total, apart = omega + omega_ref, omega - omega_ref
    conjugate = (ratio**2 * total**2 + (1 - ratio**2) * apart**2) ** 0.5  # |λ* + λ₀|
    return mac * 4 * ratio**2 * omega * omega_ref / (1 + ratio) ** 2 * (1 / conjugate + 1 / total) ** 2


def macxp_slope(mac: Any, omega: Any, omega_ref: Any, ratio: Any) -> Any:
    """Derivative of `macxp_of_one_ratio` with respect to ω; with respect to the MAC it is proportional.

    Args:
        mac: modal assurance criterion of the shapes [-].
        omega: angular natural frequency ω [rad/s], above zero.
        omega_ref: that of the reference ω₀ [rad/s].
        ratio: damping ratio ζ of both [-], above zero.

    Returns:
        ∂MACXP/∂ω [s/rad].
    """
    total, apart = omega + omega_ref, omega - omega_ref
    conjugate = (ratio**2 * total**2 + (1 - ratio**2) * apart**2) ** 0.5
    moved = (ratio**2 * total + (1 - ratio**2) * apart) / conjugate  # ∂|λ* + λ₀|/∂ω
    bell = 1 / conjugate + 1 / total
    logarithmic = 1 / omega - 2 * (moved / conjugate**2 + 1 / total**2) / bell
    return macxp_of_one_ratio(mac, omega, omega_ref, ratio) * logarithmic
