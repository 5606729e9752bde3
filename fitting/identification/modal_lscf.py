"""Poles of measured frequency responses by the poly-reference least-squares complex frequency-domain method.

The responses are fitted by a right matrix fraction H(ω) = B(z)·A(z)⁻¹ in z = e^((s - jω₁)Δ), s = jω: one row of
numerators B for each response, one denominator A of as many rows and columns as there are excitations. Multiplied by A
the error is linear, and the numerators are eliminated response by response. With the lowest coefficient of A fixed to
I, poles that the noise asks for come out unstable and are dropped, which keeps the stabilisation diagram clear.

The coefficients are complex and z starts at the band's lower end: the band fills most of the unit circle whatever its
place, and poles of negative frequency need no order of their own.

Sources: P. Guillaume, P. Verboven, S. Vanlanduit, H. Van der Auweraer, B. Peeters, "A poly-reference implementation of
the least-squares complex frequency-domain estimator", Proc. IMAC 21 (2003); B. Peeters, H. Van der Auweraer, P.
Guillaume, J. Leuridan, "The PolyMAX frequency-domain method: a new standard for modal parameter estimation?", Shock and
Vibration 11 (2004) 395-409; B. Cauberghe, P. Guillaume, P. Verboven, S. Vanlanduit, E. Parloo, "On the influence of the
parameter constraint on the stability of the poles and the discrimination capabilities of the stabilisation diagrams",
Mechanical Systems and Signal Processing 19 (2005) 989-1014.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Shaped

# Angle of the unit circle that the band fills. All of it would make its ends neighbours, half of it wastes order.
_ARC = 1.5 * np.pi


class Poles(NamedTuple):
    """Decaying poles with positive frequency, ascending in frequency."""

    poles: Complex[np.ndarray, "poles"]
    """λ [rad/s]."""
    participation: Complex[np.ndarray, "poles inputs"]
    """Modal participation of each excitation L, unit length; its product with a shape makes the residues [-]."""

    @property
    def frequency(self) -> Float[np.ndarray, "poles"]:
        """Natural frequencies |λ|/2π [Hz]."""
        return np.abs(self.poles) / (2 * np.pi)

    @property
    def damping_ratio(self) -> Float[np.ndarray, "poles"]:
        """Damping ratios [-]."""
        return -np.real(self.poles) / np.abs(self.poles)

    def take(self, kept: Shaped[np.ndarray, "_"]) -> "Poles":
        """Some of the poles.

        Args:
            kept: places or mask.
        """
        return Poles(self.poles[kept], self.participation[kept])


def largest_order(lines: int, outputs: int, inputs: int) -> int:
    """The highest order for which the lines leave equations over.

    Args:
        lines: number of lines.
        outputs: number of responses.
        inputs: number of excitations.
    """
    # Each response has lines equations for order + 1 numerators of its own and its share of the denominator.
    return int((0.8 * lines - 1) / (1 + inputs / outputs))


def lscf_poles(
    frequency: Float[np.ndarray, "frequencies"],
    values: Complex[np.ndarray, "outputs inputs frequencies"],
    weight: Float[np.ndarray, "outputs frequencies"],
    order: int,
) -> Iterator[Poles]:
    """Poles for every order from 1 to the highest.

    Args:
        frequency: lines [Hz].
        values: responses, of any form: differentiation changes numerators only.
        weight: of each line of each response, one over its standard deviation.
        order: highest order; each has as many poles per excitation.

    Returns:
        The poles of each order in turn.
    """
    omega = 2 * np.pi * frequency
    step = _ARC / (omega[-1] - omega[0])
    powers = np.exp(1j * step * (omega - omega[0])[:, None] * np.arange(order + 1))
    outputs, inputs, _ = values.shape
    gram = np.zeros((outputs, (order + 1) * inputs, (order + 1) * inputs), dtype=complex)
    cross = np.zeros((outputs, order + 1, (order + 1) * inputs), dtype=complex)
    for row in range(outputs):
        # Orthonormal columns for numerators of every order at once: those of a lower order are the first ones.
        numerators = np.linalg.qr(weight[row, :, None] * powers)[0]
        products = (weight[row] * values[row]).T[:, None, :] * powers[:, :, None]
        products = products.reshape(omega.size, -1)
        gram[row] = products.conj().T @ products
        cross[row] = numerators.conj().T @ products
    for n in range(1, order + 1):
        size = (n + 1) * inputs
        eliminated = cross[:, : n + 1, :size]
        normal = np.sum(gram[:, :size, :size], axis=0) - np.einsum("oki,okj->ij", eliminated.conj(), eliminated)
        # A₀ = I.
        rest = -np.linalg.lstsq(normal[inputs:, inputs:], normal[inputs:, :inputs], rcond=None)[0]
        yield _in_continuous_time(rest.reshape(n, inputs, inputs), omega[0], step)


def _in_continuous_time(coefficients: np.ndarray, start: float, step: float) -> Poles:
    """Poles of A(z) = I + A₁z + A₂z² + ..., and the left null vectors of A there."""
    n, inputs, _ = coefficients.shape
    # With w = 1/z: (w^n·I + A₁·w^(n-1) + ...)ᵀ·l = 0, an eigenproblem of the block companion matrix.
    companion = np.zeros((n * inputs, n * inputs), dtype=complex)
    companion[:inputs] = -np.concatenate([block.T for block in coefficients], axis=1)
    companion[inputs:, :-inputs] = np.eye((n - 1) * inputs)
    inverse, vectors = np.linalg.eig(companion)
    vectors = vectors.reshape(n, inputs, -1)
    sizes = np.linalg.norm(vectors, axis=1)
    best = vectors[np.argmax(sizes, axis=0), :, np.arange(inverse.size)]
    there = np.isfinite(inverse) & (np.abs(inverse) > 1e-12)
    logarithm = -np.log(np.where(there, inverse, 1.0))
    # The band lies at angles from 0 to the arc; what is left of the circle goes half below, half above it.
    gap = 2 * np.pi - _ARC
    angle = (np.imag(logarithm) + gap / 2) % (2 * np.pi) - gap / 2
    poles = (np.real(logarithm) + 1j * angle) / step + 1j * start
    usable = there & (np.real(poles) < 0) & (np.imag(poles) > 0)
    ascending = np.argsort(np.abs(poles[usable]))
    return Poles(poles[usable][ascending], (best / np.linalg.norm(best, axis=1, keepdims=True))[usable][ascending])
