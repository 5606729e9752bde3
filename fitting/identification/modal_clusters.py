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
