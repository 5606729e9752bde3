"""Derivatives of MACXP and NDD² of a machine's modes by its unknown springs and dampers, in closed form.

One eigenproblem gives the modes and all derivatives: K is linear in the springs, so that with b the stretch of a place,
∂λ/∂k = (bᵀφ)² and ∂φ/∂k = Σ φₘ(φₘᵀb)(bᵀφ)/(λ - λₘ) over the other modes. Of ∂φ only products with one vector for each
output are needed, which are found at once for all springs.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from fitting.identification.machine_affine import AffineMachine
from fitting.identification.machine_evidence import Evidence
from fitting.identification.machine_macxp import macxp_of_one_ratio, macxp_slope
from fitting.identification.machine_pairing import PairedSamples
from twin.modal._eigen import REPEATED


class ModeSlopes(NamedTuple):
    """MACXP and NDD² of the reference modes at some samples, and their derivatives."""

    macxp: Float[np.ndarray, "samples references"]
    """MACXP [-]."""
    ndd: Float[np.ndarray, "samples references"]
    """NDD² [-]."""
    d_macxp: Float[np.ndarray, "samples references parameters"]
    """Derivative of MACXP by each unknown parameter [1 over its unit]; zero for dampers."""
    d_ndd: Float[np.ndarray, "samples references parameters"]
    """Derivative of NDD² by each [1 over its unit]."""


def mode_slopes(
    part: AffineMachine, data: Evidence, found: PairedSamples, damping: Float[np.ndarray, "samples dampings"]
) -> ModeSlopes:
    """MACXP and NDD² of the mode that stands for each reference mode, differentiated; the pairing is not.

    Shapes of one repeated eigenvalue are not turned into each other, as in `twin.modal`. Where two modes are near each
    other their shapes turn fast, and the derivatives are as large as that.

    Args:
        part: the machine at a position.
        data: reference modes there.
        found: its modes at the samples.
        damping: unknown dampings at the samples.
    """
    omega, own = found.omega, found.own
    squared = omega**2
    stretch = np.swapaxes(own, 1, 2) @ part.springs
    apart = squared[:, None, :] - found.eigenvalues[:, :, None]
    together = np.abs(apart) <= REPEATED * np.abs(found.eigenvalues).max(axis=1)[:, None, None]
    beside = np.where(together, 0.0, 1 / np.where(together, 1.0, apart))
    owner = (part.spring_of[:, None] == np.arange(part.stiffness.size)).astype(float)

    def by_springs(right: np.ndarray, per_eigenvalue: np.ndarray) -> np.ndarray:
        # Of an output with derivative `right` by the shape, (samples, n, references).
        adjoint = found.shapes @ (beside * (np.swapaxes(found.shapes, 1, 2) @ right))
        turned = np.swapaxes(adjoint, 1, 2) @ part.springs
        return (turned * stretch + per_eigenvalue[..., None] * stretch**2) @ owner

    moved = part.output_map @ own
    length, along = np.sum(moved**2, axis=1), np.sum(moved * data.shapes, axis=1)
    # MAC = along²/length, and MACXP is proportional to it.
    share = along / length
    right = 2 * (part.output_map.T @ (share[:, None] * data.shapes - share[:, None] ** 2 * moved))
    per_mac = macxp_of_one_ratio(1.0, omega, data.omega, data.ratio)
    per_value = macxp_slope(along * share, omega, data.omega, data.ratio) / (2 * omega)
    shape = by_springs(per_mac[:, None] * right, per_value)

    ratio, right, per_value = _damping(part, omega, own, damping)
    factor = 2 * (ratio / data.ratio - 1) / data.ratio  # of eq. 5
    d_ndd = by_springs(factor[:, None] * right, factor * per_value)

    d_macxp, d_damping = np.zeros((2, *omega.shape, part.stiffness.size + part.damping.size))
    d_macxp[..., part.stiffness] = shape
    d_damping[..., part.stiffness] = d_ndd
    d_damping[..., part.damping] = factor[..., None] * part.damping_ratios(omega, own)[1]
    return ModeSlopes(found.macxp, (ratio / data.ratio - 1) ** 2, d_macxp, d_damping)


def _damping(
    part: AffineMachine, omega: np.ndarray, own: np.ndarray, damping: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Damping ratio of each mode, and its derivatives by the shape and by the eigenvalue."""
    stroke = part.dampers.T @ own
    forces = []
    for known, mine in ((part.viscous, part.is_viscous), (part.hysteretic, ~part.is_viscous)):
        each = np.where(mine, damping, 0.0)[:, part.damper_of]
        forces.append(known @ own + part.dampers @ (each[..., None] * stroke))
    viscous = np.sum(own * forces[0], axis=1) / (2 * omega)
    hysteretic = np.sum(own * forces[1], axis=1) / (2 * omega**2)
    right = forces[0] / omega[:, None] + forces[1] / omega[:, None] ** 2
    return viscous + hysteretic, right, -(viscous / 2 + hysteretic) / omega**2
