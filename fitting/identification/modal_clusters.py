"""Errors of a modal fit that whole responses make: gains that scatter, sensors that sit askew, nodes that were missed.

Such an error is the same at all lines of a response, so that lines do not average it out. The covariance of a fit whose
rows err alike within clusters, here the measured responses, is

    H⁻¹·(Σ_c s_c·s_cᵀ)·H⁻¹·C/(C - 1),   s_c = J_cᵀ·r_c

with J the Jacobian after the projection that eliminates the shapes, J_c and r_c its rows and the residuals of one
response, H = JᵀJ, and C clusters.

Source: K.-Y. Liang, S. L. Zeger, "Longitudinal data analysis using generalized linear models", Biometrika 73 (1986)
13-22; C. B. Hansen, "Asymptotic properties of a robust variance matrix estimator for panel data when T is large",
J. Econometrics 141 (2007) 597-620.
"""

import numpy as np
from jaxtyping import Float

from fitting.identification.modal_poles import ModalPoles
from fitting.identification.modal_refinement import ModalProblem, factored

# Fewer responses say nothing of how responses scatter.
LEAST_CLUSTERS = 6
# Share of the largest curvature below which nothing is known of a direction.
_UNSEEN = 1e-13
# Standard deviations by which gains must scatter more than noise makes them before it is believed.
_ASKED = 3.0


def cluster_deviation(problem: ModalProblem, model: ModalPoles) -> Float[np.ndarray, "parameters"] | None:
    """Standard deviations of the parameters where each measured response errs as a whole.

    Args:
        problem: measured responses with their weights.
        model: poles and participations of least squares.

    Returns:
        Standard deviations in the parameters' own units, or None where there are too few responses to tell.
    """
    outputs, inputs = problem.size.size, model.inputs
    clusters = outputs * inputs
    if clusters < LEAST_CLUSTERS:
        return None
    found = problem.linearised(model)
    columns = problem.columns(model)
    slopes, places = problem.stacked_slopes(model)
    count = places.shape[0]
    scores = np.empty((outputs, inputs, count))
    for own in problem.groups():
        profile = problem.profile[own[0]][:, None]
        left = factored(profile * columns)[0]
        moving = profile * slopes
        beside = moving - left @ (left.T @ moving)
        for row in own:
            parts = found.coefficients[row][places] * problem.size[row]
            weighted = (beside * found.residual[row][:, None]).reshape(inputs, -1, count, 2).sum(axis=1)
            scores[row] = np.einsum("ipa,pa->ip", weighted, parts)
    size = np.sqrt(np.maximum(np.diag(found.curvature), 1e-300))
    values, turn = np.linalg.eigh(found.curvature / np.outer(size, size))
    inverse = np.where(values > _UNSEEN * values.max(), 1 / np.maximum(values, 1e-300), 0.0)
    moved = scores.reshape(clusters, count) / size @ (turn * inverse) @ turn.T / size
    return np.sqrt(np.sum(moved**2, axis=0) * clusters / (clusters - 1))


def gain_scatter(problem: ModalProblem, model: ModalPoles, power: float) -> float:
    """Standard deviation of the gains of single responses, told from what the modes leave of them [-].

    A response that is too large by a share leaves that share of itself. Of shapes and participations each takes up a
    gain that all its responses have in common, which leaves (outputs - 1)·(inputs - 1) to tell by. Where each mode is
    driven by an excitation of its own the shapes take up more, and the deviation is too small.

    Args:
        problem: measured responses with their weights.
        model: poles and participations of least squares.
        power: variance of the weighted residuals.

    Returns:
        The deviation; 0 where noise explains what is left, and where there is one excitation, by which gains and
        shapes cannot be told apart.
    """
    outputs, inputs = problem.size.size, model.inputs
    freedom = (outputs - 1) * (inputs - 1)
    if outputs * inputs < LEAST_CLUSTERS or freedom < 1:
        return 0.0
    weight = problem.profile * problem.size[:, None]
    rest = problem.linearised(model).residual
    rows = (outputs, inputs, -1)
    there = (weight * problem.measured + rest).reshape(rows)  # responses of the modes, weighted
    size = np.maximum(np.sum(there**2, axis=2), 1e-300)
    gains = np.sum(there * rest.reshape(rows), axis=2) / size
    noise = power / size
    if np.sum(gains**2 / noise) < freedom + _ASKED * np.sqrt(2 * freedom):
        return 0.0
    return float(np.sqrt(max(np.sum(gains**2 - noise * freedom / gains.size), 0.0) / freedom))
