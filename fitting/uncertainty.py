"""How well a fit knows its parameters."""

from typing import NamedTuple

import numpy as np
from jaxtyping import ArrayLike

from twin._checks import InputError


class Covariance(NamedTuple):
    """Covariance of the scaled vector, and what it says about the problem."""

    matrix: np.ndarray
    """Covariance (parameters, parameters); NaN for parameters on a bound or not seen by the data."""
    condition_number: float
    """Condition of the Jacobian with its columns normalised: large where parameters explain the same data."""
    degrees_of_freedom: int
    """Residuals minus parameters that were free to move."""
    unseen: np.ndarray
    """Which parameters lie in a direction that the data do not see."""


def covariance_of(
    residual: ArrayLike, jacobian: ArrayLike, active: ArrayLike, *, series: int | None = None, priors: int = 0
) -> Covariance:
    """Linear-theory covariance σ²(JᵀJ)⁻¹ by singular values of the column-normalised Jacobian.

    σ² is estimated from the residual, as data rarely know their own variance exactly. Parameters on an active bound are
    taken as fixed there.

    Args:
        residual: weighted residual (residuals,).
        jacobian: its Jacobian in the scaled vector (residuals, parameters).
        active: which parameters sit on a bound (parameters,).
        series: number of equally long time series that the residual consists of, if neighbouring errors hang together;
            the covariance is then Newey and West's (Econometrica 55, 1987), with the correlation of the scores up to
            the lag over which the residual forgets itself. None: errors are independent.
        priors: number of rows at the end of the residual that are priors, not samples of a series.

    Returns:
        The covariance.
    """
    r, j, held = np.asarray(residual), np.asarray(jacobian), np.asarray(active)
    count = j.shape[1]
    unseen = np.zeros(count, dtype=bool)
    matrix = np.full((count, count), np.nan)
    if not (np.all(np.isfinite(r)) and np.all(np.isfinite(j))):
        return Covariance(matrix, float("nan"), r.size - count, unseen)

    norms = np.linalg.norm(j, axis=0)
    silent = (norms == 0) & ~held
    unseen[silent] = True
    free = np.flatnonzero(~held & ~silent)
    freedom = r.size - free.size
    if free.size == 0:
        return Covariance(matrix, float("inf") if silent.any() else 1.0, freedom, unseen)

    _, values, rotations = np.linalg.svd(j[:, free] / norms[free], full_matrices=False)
    seen = values > max(r.size, count) * np.finfo(float).eps * values[0]
    condition = float(values[0] / values[-1]) if seen.all() and not silent.any() else float("inf")
    if not seen.all():
        # A parameter takes part in an unseen direction if its share of the null space is more than rounding.
        share = np.linalg.norm(rotations[~seen], axis=0)
        unseen[free[share > 1e-6]] = True
    variance = float(r @ r) / freedom if freedom > 0 else float("nan")
    root = rotations[seen].T / values[seen]
    normalised = variance * root @ root.T
    if series is not None:
        spread = root @ root.T / np.outer(norms[free], norms[free])
        scores, samples = j[:, free] * r[:, None], r.size - priors
        if samples % series:
            raise InputError(f"{samples} residuals do not divide into {series} series of equal length.")
        along = scores[:samples].reshape(series, -1, free.size).sum(axis=0)
        middle = _long_run(along, _memory(r[:samples].reshape(series, -1))) + scores[samples:].T @ scores[samples:]
        normalised = spread @ middle @ spread * np.outer(norms[free], norms[free])
    known = ~unseen[free]
    block = normalised / np.outer(norms[free], norms[free])
    matrix[np.ix_(free[known], free[known])] = block[np.ix_(known, known)]
    return Covariance(matrix, condition, freedom, unseen)


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
