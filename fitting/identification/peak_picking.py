"""Stiffness and damping of a mass on a spring and damper, read off the -90° point of its frequency response."""

from typing import NamedTuple

import numpy as np
from jaxtyping import ArrayLike, Complex, Float

from twin._checks import InputError, finite, increasing, positive

ESTIMATORS = ("paper", "exact")
# Lines on either side of the crossing through which the response is smoothed by a parabola.
_NEIGHBOURS = 3


class Peak(NamedTuple):
    """What the -90° point of a response V_T/V_1 tells."""

    frequency: float
    """Frequency f₀ at which the phase is -90° [Hz]."""
    magnitude: float
    """Magnitude |G(jω₀)| there [-]."""
    stiffness: float
    """Stiffness k [N/m]."""
    damping: float
    """Damping d [Ns/m]."""
    damping_ratio: float
    """Damping ratio D = d/(2·√(k·m)) [-]; for `paper` as printed, D = 1/(2·|G(jω₀)|)."""


class NoCrossing(InputError):
    """A response whose phase does not fall through -90° in the band."""


def check_estimator(estimator: str) -> None:
    """Raise unless the estimator is known.

    Args:
        estimator: "paper" or "exact".

    Raises:
        InputError: if it is another.
    """
    if estimator not in ESTIMATORS:
        raise InputError(f'estimator must be "paper" or "exact", but is {estimator!r}. Choose one of the two.')


def pick_peak(
    frequency: Float[ArrayLike, "_"],
    response: Complex[ArrayLike, "_"],
    mass: float,
    *,
    estimator: str = "exact",
    guide_damping: float = 0.0,
    band: tuple[float, float] = (0.0, np.inf),
) -> Peak:
    """Stiffness and damping from the -90° point of the response of a mass driven through a spring and a damper.

    "paper": k = ω₀²·m, D = 1/(2·|G|), d = D·2·m·ω₀ (Leipe et al., eq. 1a, 1b), which is right for a lag of second
    order, G = k/(m·s² + d·s + k). But the table is driven through the damper as well. The phase of

        G = (d·s + k)/(m·s² + (d + d_f)·s + k)

    is -90° beyond the natural frequency: there, with d_f = 0, m·ω₀² = k·(1 + 1/|G|²), so that k and d read high by the
    factor 1/(1 - 4·D²), 2.6 to 5.1 % for D = 0.08 to 0.11, and D by the root of it.

    "exact" solves this G for k and d at the same point: d + d_f = k/(ω₀·|G|) and k·(1 + 1/|G|²) = m·ω₀² +
    d_f·ω₀/|G|.

    Args:
        frequency: frequencies, increasing [Hz].
        response: G = V_T/V_1.
        mass: mass m of the table [kg].
        estimator: "paper" or "exact".
        guide_damping: slope d_f of the table's friction, where it is known [Ns/m]; "exact" only.
        band: where to look for the peak [Hz].

    Raises:
        InputError: unknown estimator, a mass that is not positive, values that are not finite, frequencies that do not
            increase.
        NoCrossing: no -90° point in the band.
    """
    check_estimator(estimator)
    positive("mass", mass, "kg")
    f, g = np.asarray(frequency, dtype=float), np.asarray(response)
    if f.ndim != 1 or f.shape != g.shape:
        raise InputError(f"frequency has shape {f.shape} and the response {g.shape}; give two vectors of one length.")
    increasing("frequency", f, "Hz")
    finite("guide_damping", guide_damping, "Ns/m")
    inside = (f >= band[0]) & (f <= band[1])
    f, g = f[inside], g[inside]
    if not np.all(np.isfinite(g)):
        raise InputError("The response holds NaN or infinity. Leave such lines out.")
    crossing = _crossing(f, g, band)
    omega, magnitude = 2 * np.pi * crossing[0], crossing[1]
    if estimator == "paper":
        ratio = 1 / (2 * magnitude)
        return Peak(crossing[0], magnitude, omega**2 * mass, 2 * mass * omega * ratio, ratio)  # eq. 1a, 1b
    stiffness = (mass * omega**2 + guide_damping * omega / magnitude) / (1 + 1 / magnitude**2)
    damping = stiffness / (omega * magnitude) - guide_damping
    return Peak(crossing[0], magnitude, stiffness, damping, damping / (2 * np.sqrt(stiffness * mass)))


def _crossing(f: np.ndarray, g: np.ndarray, band: tuple[float, float]) -> tuple[float, float]:
    """Frequency and magnitude at the -90° point next to the highest magnitude; the response is smoothed about it."""
    real, imaginary = np.real(g), np.imag(g)
    falls = np.flatnonzero((real[:-1] > 0) & (real[1:] <= 0) & (imaginary[:-1] < 0))
    if falls.size == 0:
        where = f"from {f[0]:g} to {f[-1]:g} Hz" if f.size else f"between {band[0]:g} and {band[1]:g} Hz"
        raise NoCrossing(
            f"The phase of the response does not fall through -90° {where}. Widen the band, excite it higher, or check "
            "that input and output are not exchanged."
        )
    first = falls[np.argmax(np.abs(g[falls]))]
    low, high = max(0, first - _NEIGHBOURS + 1), min(f.size, first + _NEIGHBOURS + 1)
    part = real[first] / (real[first] - real[first + 1])
    start = f[first] + part * (f[first + 1] - f[first])
    if high - low < 4:
        return float(start), float(abs(g[first] + part * (g[first + 1] - g[first])))
    scale = f[high - 1] - f[low]
    basis = ((f[low:high] - start) / scale)[:, None] ** np.arange(3)
    coefficients, *_ = np.linalg.lstsq(basis.astype(complex), g[low:high], rcond=None)
    roots = np.roots(np.real(coefficients)[::-1])
    places = np.real(roots)[np.abs(np.imag(roots)) < 1e-9]
    nearest = places[np.argmin(np.abs(places))] if places.size else 0.0
    nearest = float(np.clip(nearest, -0.5, 0.5))
    smooth = coefficients @ nearest ** np.arange(3)
    return float(start + scale * nearest), float(abs(smooth))
