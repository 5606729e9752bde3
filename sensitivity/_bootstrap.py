"""The bootstrap as a matrix product: each resample is a row of weights over the points drawn from."""

import numpy as np

from twin._checks import InputError


def bootstrap_weights(n: int, resamples: int, seed: int) -> np.ndarray:
    """Weights of the points (1 + resamples, n): equal ones first, then how often each is drawn, as SALib draws.

    Args:
        n: points.
        resamples: bootstrap samples.
        seed: seed, at least 1.
    """
    drawn = np.random.default_rng(seed).integers(n, size=(n, resamples))
    counts = np.bincount((drawn + n * np.arange(resamples)).ravel(), minlength=n * resamples)
    return np.vstack([np.ones(n), counts.reshape(resamples, n)]) / n


def weighted(weights: np.ndarray, terms: np.ndarray) -> np.ndarray:
    """Means of terms (points, ...) over every resample (1 + resamples, ...).

    Args:
        weights: of `bootstrap_weights`.
        terms: terms, with the points first.
    """
    return (weights @ terms.reshape(len(terms), -1)).reshape(len(weights), *terms.shape[1:])


def with_interval(drawn: np.ndarray, confidence: float) -> tuple[np.ndarray, np.ndarray]:
    """Estimate and half width of its normal interval (outputs, names), from (1 + resamples, names, outputs).

    Args:
        drawn: the estimate first, then those of the resamples.
        confidence: probability of the interval.
    """
    from scipy import special  # half a second to import

    return drawn[0].T, special.ndtri(0.5 + confidence / 2) * drawn[1:].std(axis=0, ddof=1).T


def require_interval(confidence: float, resamples: int) -> None:
    """Raise unless intervals can be made.

    Args:
        confidence: probability of the intervals.
        resamples: bootstrap samples.

    Raises:
        InputError: with the cure.
    """
    if not 0 < confidence < 1:
        raise InputError(f"confidence must be between 0 and 1, but is {confidence}. For 95 % give 0.95.")
    if resamples < 2:
        raise InputError(f"resamples must be at least 2, but is {resamples}. 100 is usual.")
