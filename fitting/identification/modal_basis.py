"""Frequency responses as sums over modes, linear in shapes and residual terms once the poles are known.

With poles λ, participations L and shapes ψ the receptance of output o to input i is

    H_oi(s) = Σ ψ_o·L_i/(s - λ) + conj(ψ_o·L_i)/(s - λ*)  +  lower_oi/s² + upper_oi        (viscous)
    H_oi(s) = Σ ψ_o·L_i·2j·Im(λ)/(s² - λ²)                +  lower_oi/s² + upper_oi        (hysteretic)

at s = jω. The residual terms stand for modes below the band, rigid-body motion among them, and above it. Mobility is s
times, accelerance s² times that.

Source: D. J. Ewins, "Modal Testing: Theory, Practice and Application", 2nd ed., Research Studies Press 2000, ch. 4;
least squares in the frequency domain (LSFD): P. Guillaume et al., as `modal_lscf` names.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float

FORMS = {"receptance": 0, "mobility": 1, "accelerance": 2}
"""How often the receptance is differentiated."""
DAMPING = ("viscous", "hysteretic")
# Columns that are combinations of others but for this share are left out.
_DEPENDENT = 1e-13


class ModalKind(NamedTuple):
    """What responses are, and what they are made of."""

    form: str
    """Receptance, mobility or accelerance."""
    damping: str = "viscous"
    """Viscous or hysteretic."""
    residual_terms: bool = True
    """Whether there are terms for modes below and above the band."""


def modal_basis(
    frequency: Float[np.ndarray, "frequencies"],
    poles: Complex[np.ndarray, "modes"],
    participation: Complex[np.ndarray, "modes inputs"],
    kind: ModalKind,
) -> Complex[np.ndarray, "inputs frequencies columns"]:
    """Columns of which every output's responses are a real combination.

    Args:
        frequency: lines [Hz].
        poles: λ [rad/s].
        participation: L.
        kind: what the responses are.

    Returns:
        Those of the real and of the imaginary parts of ψ, then of the lower and of the upper terms, each over its size:
        2·modes + 4·inputs columns.
    """
    s = 2j * np.pi * frequency
    inputs = participation.shape[1]
    if kind.damping == "viscous":
        direct = participation[:, :, None] / (s - poles[:, None])[:, None, :]
        mirrored = np.conj(participation)[:, :, None] / (s - np.conj(poles)[:, None])[:, None, :]
        columns = [direct + mirrored, 1j * (direct - mirrored)]
    else:
        direct = participation[:, :, None] * (2j * np.imag(poles)[:, None] / (s**2 - poles[:, None] ** 2))[:, None, :]
        columns = [direct, 1j * direct]
    if kind.residual_terms:
        middle = 2 * np.pi * frequency[frequency.size // 2]
        one = np.eye(inputs)[:, :, None]
        lower, upper = one * (middle / s) ** 2, one * np.ones_like(s)
        # In the size of the poles' columns, for the sake of the numbers.
        columns += [part * lower / middle for part in (1, 1j)] + [part * upper / middle for part in (1, 1j)]
    return np.moveaxis(np.concatenate(columns) * s ** FORMS[kind.form], 0, -1)


def in_reals(values: np.ndarray) -> np.ndarray:
    """Complex numbers (..., inputs, frequencies) as real rows (..., inputs·2·frequencies): first real parts.

    Args:
        values: complex numbers.
    """
    return np.stack([np.real(values), np.imag(values)], axis=-2).reshape(*values.shape[:-2], -1)


def solve_linear(basis: np.ndarray, values: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shapes and residual terms of least squares.

    Args:
        basis: columns of `modal_basis` (inputs, frequencies, columns).
        values: responses (outputs, inputs, frequencies).
        weight: one over the standard deviation of each, or of each line (frequencies,) if all are alike.

    Returns:
        Coefficients (outputs, columns), and the weighted residual (outputs, inputs, frequencies).
    """
    columns = in_reals(np.moveaxis(basis, -1, 0)).T
    measured = in_reals(values)
    weights = in_reals((1 + 1j) * np.broadcast_to(weight, values.shape))
    if weight.ndim == 1:
        coefficients = _least_squares(columns * weights[0][:, None], (measured * weights[0]).T).T
    else:
        pairs = zip(measured, weights, strict=True)
        coefficients = np.stack([_least_squares(columns * own[:, None], row * own) for row, own in pairs])
    error = values - synthesised(basis, coefficients)
    return coefficients, error * np.broadcast_to(weight, values.shape)


def _least_squares(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    size = np.linalg.norm(matrix, axis=0)
    left, factor = np.linalg.qr(matrix / size)
    diagonal = np.abs(np.diag(factor))
    inside = left.T @ right
    if diagonal.min() > _DEPENDENT * diagonal.max():
        solved = np.linalg.solve(factor, inside)
    else:
        solved = np.linalg.lstsq(factor, inside, rcond=_DEPENDENT)[0]
    return (solved.T / size).T


def synthesised(basis: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    """Responses (outputs, inputs, frequencies) of coefficients.

    Args:
        basis: columns of `modal_basis`.
        coefficients: (outputs, columns).
    """
    return np.einsum("ifk,ok->oif", basis, coefficients)


def shapes_of(coefficients: np.ndarray, modes: int) -> np.ndarray:
    """Shapes ψ (outputs, modes), scaled by their participations.

    Args:
        coefficients: (outputs, columns).
        modes: number of modes.
    """
    return coefficients[:, :modes] + 1j * coefficients[:, modes : 2 * modes]
