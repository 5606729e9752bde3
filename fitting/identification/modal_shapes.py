"""Shapes of measured modes at a scale: mass-normalised where a driving point was measured."""

from typing import NamedTuple

import numpy as np

from fitting.identification.modal_reciprocity import same_direction

# Largest angle of a driving point's residues against those of the form stated, as its cosine.
_COSINE = 0.7


class ScaledShapes(NamedTuple):
    """Shapes, and by what they are scaled."""

    shapes: np.ndarray
    """Complex shapes (outputs, modes): mass-normalised, or with 1 at the largest row."""
    errors: np.ndarray
    """Standard errors of their entries, both parts together; rather too large at driving points, whose error is in the
    scale as well."""
    driving_points: tuple[str, ...]
    """Driving points by which they are mass-normalised; empty if there is none."""
    remarks: tuple[str, ...]
    """What the driving points say about the data."""


def scaled_shapes(
    poles: np.ndarray,
    shapes: np.ndarray,
    errors: np.ndarray,
    participation: np.ndarray,
    outputs: tuple[str, ...],
    inputs: tuple[str, ...],
) -> ScaledShapes:
    """Scale shapes by what a driving point says about the modal mass.

    With unit modal masses the residues are φφᵀ/(2j·Im(λ)), as those of `twin.modal.damped_modes`, so that
    participations are φ at the excitations times 1/(2j·Im(λ)). Several driving points are weighed by least squares. A
    point that was hit against the direction of its sensor ("3 -z" and "3 z") is one as well.

    Args:
        poles: λ (modes,) [rad/s].
        shapes: ψ (outputs, modes) at the scale of the participations.
        errors: standard errors of their parts, complex.
        participation: L (modes, inputs).
        outputs: names of the responses.
        inputs: names of the excitations.
    """
    pairs = [
        (o, i, sign) for i, b in enumerate(inputs) for o, a in enumerate(outputs) if (sign := same_direction(a, b))
    ]
    spread = np.abs(errors)
    if not pairs:
        return _by_largest(shapes, spread, ())
    rows, columns, signs = (np.array(x) for x in zip(*pairs, strict=True))
    driven, along = shapes[rows], participation[:, columns].T * signs[:, None]
    power = np.sum(np.abs(driven) ** 2, axis=0)
    square = 2j * np.imag(poles) * np.sum(driven.conj() * along, axis=0) / np.where(power > 0, power, 1.0)
    remarks = _judged(poles, driven, along)
    if remarks:
        return _by_largest(shapes, spread, remarks)
    factor = np.sqrt(square)
    scaled = shapes * factor
    # Half of the driving point's own relative error is that of the scale.
    own = 0.5 * np.sqrt(np.sum(spread[rows] ** 2, axis=0) / np.where(power > 0, power, 1.0))
    uncertain = np.sqrt((spread * np.abs(factor)) ** 2 + (np.abs(scaled) * own) ** 2)
    largest = np.take_along_axis(scaled, np.argmax(np.abs(scaled), axis=0)[None], axis=0)
    scaled = scaled * np.where(np.real(largest) < 0, -1.0, 1.0)
    return ScaledShapes(scaled, uncertain, tuple(outputs[row] for row in rows), ())


def _by_largest(shapes: np.ndarray, spread: np.ndarray, remarks: tuple[str, ...]) -> ScaledShapes:
    largest = np.take_along_axis(shapes, np.argmax(np.abs(shapes), axis=0)[None], axis=0)
    size = np.where(largest == 0, 1.0, largest)
    return ScaledShapes(shapes / size, spread / np.abs(size), (), remarks)


def _judged(poles: np.ndarray, driven: np.ndarray, along: np.ndarray) -> tuple[str, ...]:
    """Modal masses are positive: driving points show whether the responses are of the form stated."""
    masses = 2j * np.imag(poles) * driven * along
    total = np.sum(np.abs(masses))
    direction = np.sum(masses) / total if total > 0 else 1.0
    if direction.real >= _COSINE:
        return ()
    angle = abs(np.degrees(np.angle(direction)))
    return (
        f"The driving points' residues are turned by {angle:.0f}° from those of positive modal masses: the "
        "responses are of another form (receptance, mobility, accelerance) than stated, or the sign of a sensor is "
        "wrong. Frequencies and damping ratios do not depend on it; shapes are not mass-normalised.",
    )
