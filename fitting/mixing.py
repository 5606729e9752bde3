"""How well chains of samples have mixed: rank-normalised split R-hat and bulk effective sample size.

A. Vehtari, A. Gelman, D. Simpson, B. Carpenter and P.-C. Bürkner, "Rank-normalization, folding, and localization: an
improved R̂ for assessing convergence of MCMC", Bayesian Analysis 16 (2021) 667.
"""

import numpy as np


def r_hat(samples: np.ndarray) -> np.ndarray:
    """R̂: the larger of that of the ranks and that of the ranks of the distances from the median (section 4).

    Args:
        samples: (chains, samples, parameters).

    Returns:
        One per parameter; NaN for a parameter that never moved or is not finite.
    """
    halves = _halves(samples)
    folded = np.abs(halves - np.median(halves, axis=(0, 1)))
    return np.maximum(_plain_r_hat(_normal_scores(halves)), _plain_r_hat(_normal_scores(folded)))


def effective_size(samples: np.ndarray) -> np.ndarray:
    """Bulk effective sample size: that of the rank-normalised half chains, by eq. 10 to 13 with Geyer's sequence.

    Args:
        samples: (chains, samples, parameters).

    Returns:
        One per parameter; NaN for a parameter that never moved or is not finite.
    """
    scores = _normal_scores(_halves(samples))
    return np.asarray([_size_of(scores[:, :, i]) for i in range(scores.shape[2])])


def _halves(samples: np.ndarray) -> np.ndarray:
    half = samples.shape[1] // 2
    return np.concatenate([samples[:, :half], samples[:, half : 2 * half]])


def _normal_scores(samples: np.ndarray) -> np.ndarray:
    """Normal quantiles of the ranks over all chains, eq. 14."""
    from scipy import stats  # two seconds to import

    flat = samples.reshape(-1, samples.shape[2])
    ranks = stats.rankdata(flat, axis=0)
    scores = stats.norm.ppf((ranks - 0.375) / (len(flat) + 0.25))
    bad = ~np.all(np.isfinite(flat), axis=0) | np.all(flat == flat[0], axis=0)
    return np.where(bad, np.nan, scores).reshape(samples.shape)


def _plain_r_hat(samples: np.ndarray) -> np.ndarray:
    """Eq. 1 to 4."""
    length = samples.shape[1]
    within = np.mean(np.var(samples, axis=1, ddof=1), axis=0)
    between = np.var(np.mean(samples, axis=1), axis=0, ddof=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.sqrt((length - 1) / length + between / within)


def _size_of(samples: np.ndarray) -> float:
    chains, length = samples.shape
    if not np.all(np.isfinite(samples)):
        return float("nan")
    centred = samples - samples.mean(axis=1, keepdims=True)
    transform = np.fft.rfft(centred, 2 * length, axis=1)
    covariance = np.fft.irfft(np.abs(transform) ** 2, axis=1)[:, :length].mean(axis=0) / length
    within = covariance[0] * length / (length - 1)
    total = covariance[0] + np.var(samples.mean(axis=1), ddof=1)
    correlation = 1 - (within - covariance) / total
    correlation[0] = 1.0
    pairs = correlation[: length // 2 * 2].reshape(-1, 2).sum(axis=1)
    end = int(np.argmax(pairs < 0)) if (pairs < 0).any() else pairs.size
    falling = np.minimum.accumulate(pairs[:end])
    # Antithetic chains may have a negative sum; the limit is that of Stan.
    time = max(2 * float(falling.sum()) - 1, 1 / np.log10(samples.size))
    return float(chains * length / time)
