"""How far a shape is a standing wave: modal phase collinearity."""

import numpy as np
from jaxtyping import Complex, Float


def phase_collinearity(shapes: Complex[np.ndarray, "rows modes"]) -> Float[np.ndarray, "modes"]:
    """Modal phase collinearity |Σψ²|²/(Σ|ψ|²)² of each shape: 1 where all rows move in phase or against it.

    Args:
        shapes: one shape per column.

    Returns:
        Values from 0 (a travelling wave) to 1 (a standing wave); NaN for a shape that is zero.

    Source: R. S. Pappa, K. B. Elliott, A. Schenk, "Consistent-mode indicator for the eigensystem realization
    algorithm", J. Guidance, Control, and Dynamics 16 (1993) 852-858, without taking out the mean of the rows.
    """
    power = np.sum(np.abs(shapes) ** 2, axis=0)
    straight = np.abs(np.sum(shapes**2, axis=0))
    return np.where(power > 0, straight / np.where(power > 0, power, 1.0), np.nan) ** 2


def real_shapes(shapes: Complex[np.ndarray, "rows modes"]) -> Float[np.ndarray, "rows modes"]:
    """Each shape turned by the phase that makes it as real as it gets, and its real part.

    Args:
        shapes: one shape per column.

    Returns:
        Real shapes of about the same length; the sign is that of the largest row before.
    """
    turn = np.exp(-0.5j * np.angle(np.sum(shapes**2, axis=0)))
    turned = np.real(shapes * turn)
    largest = np.argmax(np.abs(shapes), axis=0)[None]
    before, after = (np.take_along_axis(x, largest, axis=0) for x in (np.real(shapes), turned))
    return turned * np.where(before * after < 0, -1.0, 1.0)
