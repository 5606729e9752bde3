"""How well a fit knows its parameters."""

from typing import NamedTuple

import numpy as np
from jaxtyping import ArrayLike

from twin._checks import InputError

# Mean curvature of robust losses, relative to the square, below which a point is no minimum.
_FLAT = 1e-6


class Covariance(NamedTuple):
    """Covariance of the scaled vector, and what it says about the problem."""

    matrix: np.ndarray
    """Covariance (parameters, parameters); NaN for parameters on a bound or not seen by the data, and throughout where
    robust losses bend the other way, so that the point is no minimum."""
    condition_number: float
    """Condition of the Jacobian with its columns normalised: large where parameters explain the same data."""
    degrees_of_freedom: int
    """Data minus the parameters that they determine; one that a prior determines does not count."""
    unseen: np.ndarray
    """Which parameters lie in a direction that the data do not see."""


def covariance_of(
    residual: ArrayLike,
    jacobian: ArrayLike,
    active: ArrayLike,
    *,
    series: int | None = None,
    priors: int = 0,
    curvature: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    variance: str = "estimated",
) -> Covariance:
    """Linear-theory covariance by singular values of the column-normalised Jacobian.

    Independent errors: with H = JᵀJ + P, P that of the priors, it is H⁻¹(σ²·JᵀJ + P)H⁻¹, which is σ²(JᵀJ)⁻¹ where there
    are no priors. A prior is absolute, its standard deviation is what it says; the data's weights need be right only
    among each other, and σ² is estimated from their residual over the degrees of freedom that the fit has left them,
    rows minus the trace of J·H⁻¹·Jᵀ (few data that are far better than their weights say give a σ² on the safe side).
    With `variance="known"` it is 1, and the covariance H⁻¹ that of the conjugate normal posterior. The estimate itself
    weighs priors against data as the weights say, whatever σ² turns out to be: look whether the weighted rms is near 1.

    Robust losses: the sandwich of M-estimators H⁻¹·S·H⁻¹ with H = Σψ'·g·gᵀ and S = Σψ²·g·gᵀ over the gradients g of
    the plain residuals (Huber and Ronchetti, Robust Statistics, 2nd ed. 2009, ch. 7). It is written in the rows of the
    robust residual φ, as ψ = φ·φ'. To S comes what the fit takes out of each row, its leverage times the mean square of
    the rows that are no outliers (without it a row that alone determines a parameter would claim to do so exactly), and
    the factor m/(m - n): intervals then hold down to some ten rows per parameter.

    Parameters on an active bound are taken as fixed there; constraints by their gradients.

    Args:
        residual: weighted residual (residuals,).
        jacobian: its Jacobian in the scaled vector (residuals, parameters).
        active: which parameters sit on a bound (parameters,).
        series: number of equally long time series that the residual consists of, if neighbouring errors hang together;
            the covariance is then Newey and West's (Econometrica 55, 1987), with the correlation of the scores up to
            the lag over which the residual forgets itself. None: errors are independent.
        priors: number of rows at the end of the residual that are priors, not samples of a series.
        curvature: ψ'/φ'² of each row before the priors, if the residual holds robust losses: see
            `fitting.residuals.residual.evaluate`.
        normals: gradients in the scaled vector of the constraints that hold (constraints, parameters). What they fix
            has no variance.
        variance: "estimated", or "known" where the weights are exact.

    Returns:
        The covariance.

    Raises:
        InputError: residuals that do not divide into the series; a variance that is neither; a known variance together
            with correlated errors or robust losses, which take the variance from the residual.
    """
    r, j, held = np.asarray(residual), np.asarray(jacobian), np.asarray(active)
    if variance not in ("estimated", "known"):
        raise InputError(f'variance must be "estimated" or "known", but is {variance!r}.')
    if variance == "known" and not (series is None and curvature is None):
        raise InputError(
            'variance="known" contradicts correlated errors and robust losses, whose covariance comes from the '
            'residual itself. Use "estimated" there.'
        )
    count, samples = j.shape[1], r.size - priors
    unseen = np.zeros(count, dtype=bool)
    matrix = np.full((count, count), np.nan)
    if not (np.all(np.isfinite(r)) and np.all(np.isfinite(j))):
        return Covariance(matrix, float("nan"), r.size - count, unseen)

    free = np.flatnonzero(~held)
    norms = np.linalg.norm(j[:, free], axis=0)
    norms = np.where(norms > 0, norms, 1.0)
    allowed = _null_space(np.zeros((0, free.size)) if normals is None else np.asarray(normals)[:, free] / norms)
    if allowed.shape[1] == 0:
        matrix[np.ix_(free, free)] = 0.0
        return Covariance(matrix, 1.0, samples, unseen)

    # Rows of zeros add nothing, and let directions show that fewer rows than parameters cannot see.
    rows = np.vstack([j[:, free] / norms @ allowed, np.zeros((max(0, allowed.shape[1] - r.size), allowed.shape[1]))])
    left, values, rotations = np.linalg.svd(rows, full_matrices=False)
    seen = values > max(r.size, count) * np.finfo(float).eps * values[0]
    condition = float(values[0] / values[-1]) if seen.all() else float("inf")
    # A parameter takes part in an unseen direction if its share of the null space is more than rounding.
    unseen[free[np.linalg.norm(rotations[~seen] @ allowed.T, axis=0) > 1e-6]] = True

    data, prior = left[:samples, seen], left[samples : r.size, seen]
    left_over = samples - float(np.sum(data**2))
    freedom = round(left_over)
    square = 1.0 if variance == "known" else float(r[:samples] @ r[:samples]) / left_over if freedom > 0 else np.nan
    root = allowed @ rotations[seen].T / values[seen]
    if curvature is not None:
        bent = data.T @ (data * np.asarray(curvature)[:, None]) + prior.T @ prior
        if freedom < 1 or np.linalg.eigvalsh(bent).min(initial=1.0) < _FLAT:
            return Covariance(matrix, condition, freedom, unseen)
        root = root @ np.linalg.inv(bent)

    scores = data * r[:samples, None]
    if series is not None:
        if samples % series:
            raise InputError(f"{samples} residuals do not divide into {series} series of equal length.")
        along = scores.reshape(series, -1, scores.shape[1]).sum(axis=0)
        middle = _long_run(along, _memory(r[:samples].reshape(series, -1)))
    elif curvature is not None:
        middle = _outer_scores(data, r[:samples], np.asarray(curvature)) * samples / left_over
    else:
        middle = square * data.T @ data
    block = root @ (middle + prior.T @ prior) @ root.T / np.outer(norms, norms)
    known = ~unseen[free]
    matrix[np.ix_(free[known], free[known])] = block[np.ix_(known, known)]
    return Covariance(matrix, condition, freedom, unseen)


def _outer_scores(rows: np.ndarray, residual: np.ndarray, curvature: np.ndarray) -> np.ndarray:
    """Sum of the outer products of the scores, with what the fit has taken out of each row put back."""
    leverage = np.maximum(curvature, 0.0) * np.sum(rows**2, axis=1)
    # Outliers have no curvature, and are no measure of the others' noise.
    ordinary = np.maximum(curvature, 0.0)
    left_over = float(np.sum(ordinary)) - float(np.sum(leverage))
    square = float(ordinary @ residual**2) / left_over if left_over > 0 else np.nan
    return rows.T @ (rows * (residual**2 + leverage * square)[:, None])


def correlation_time(series: ArrayLike) -> float:
    """Integrated correlation time of the slowest of some time series, in samples; at least 1.

    n samples of a series say as much about a mean as n / (correlation time) independent ones.

    Args:
        series: one series per row (series, samples).
    """
    longest = 1.0
    for values in np.asarray(series):
        size = values.size
        correlation = np.fft.irfft(np.abs(np.fft.rfft(values, 2 * size)) ** 2)[:size]
        if correlation[0] <= 0:
            continue
        # Beyond the first change of sign there is mostly noise.
        end = int(np.argmax(correlation < 0)) or size
        longest = max(longest, 2 * float(np.sum(correlation[:end] / correlation[0])) - 1)
    return longest


def _memory(series: np.ndarray) -> int:
    """Lag up to which neighbouring errors are allowed for.

    Bartlett's weights fall linearly up to this lag; six correlation times leave out a tenth of the correlation.
    """
    return int(min(np.ceil(6 * correlation_time(series)), series.shape[1] // 4))


def _long_run(scores: np.ndarray, lag: int) -> np.ndarray:
    """Long-run covariance of the scores with Bartlett weights, positive semi-definite by construction."""
    total = scores.T @ scores
    for k in range(1, lag + 1):
        cross = scores[k:].T @ scores[:-k]
        total += (1 - k / (lag + 1)) * (cross + cross.T)
    return total


def _null_space(normals: np.ndarray) -> np.ndarray:
    """Orthonormal directions along which constraints with these gradients stay satisfied, as columns."""
    sizes = np.linalg.norm(normals, axis=1)
    rows = normals[sizes > 0] / sizes[sizes > 0, None]
    if rows.shape[0] == 0:
        return np.eye(normals.shape[1])
    _, values, rotations = np.linalg.svd(rows)
    rank = int(np.sum(values > max(rows.shape) * np.finfo(float).eps * values[0]))
    return rotations[rank:].T
