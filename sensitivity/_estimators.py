"""Sobol estimators of many outputs at once, with SALib's normalisation and its bootstrap, as matrix products."""

from typing import NamedTuple

import numpy as np

from sensitivity._bootstrap import weighted, with_interval

# Numbers held at once in the arrays of products.
_BLOCK = 4_000_000


class Estimates(NamedTuple):
    """Indices and half widths of their intervals."""

    S1: np.ndarray
    """First order (outputs, names)."""
    S1_conf: np.ndarray
    """Half width of its interval."""
    ST: np.ndarray
    """Total effect (outputs, names)."""
    ST_conf: np.ndarray
    """Half width of its interval."""
    S2: np.ndarray
    """Second order (outputs, names, names), upper triangle, NaN elsewhere; (outputs, 0, 0) where not wanted."""
    S2_conf: np.ndarray
    """Half width of its interval."""


def normalised(values: np.ndarray) -> np.ndarray:
    """Outputs with mean 0 and standard deviation 1 over all rows, as SALib does it; zero where they are constant.

    A product of two values estimates a mean square far better when the mean is taken off before (I. M. Sobol' et al.,
    Reliability Engineering and System Safety 92 (2007) 957-960).

    Args:
        values: outputs (rows, outputs).
    """
    mean, deviation = values.mean(axis=0), values.std(axis=0)
    # What is left of a constant after rounding is no variance.
    constant = deviation <= 64 * np.finfo(float).eps * np.abs(values).max(axis=0)
    return np.where(constant, 0.0, (values - mean) / np.where(constant, 1.0, deviation))


def estimates(blocks: dict[str, np.ndarray], weights: np.ndarray, confidence: float) -> Estimates:
    """First-order, total and second-order indices with bootstrapped intervals.

    First order: B·(AB - A) over the variance; total: (A - AB)²/2 over the variance (Saltelli et al. 2010, table 2 b
    and f; the latter is Jansen's). Second order: BA_j·AB_k - A·B, less both first orders (Saltelli 2002).

    Args:
        blocks: normalised outputs "A", "B" (n, outputs), "AB", and "BA" for second order (n, names, outputs).
        weights: of `bootstrap_weights`.
        confidence: probability of the intervals.
    """
    names, outputs = blocks["AB"].shape[1:]
    width = max(1, _BLOCK // ((len(weights) + weights.shape[1]) * names))
    parts = []
    for start in range(0, outputs, width):
        part = {name: block[..., start : start + width] for name, block in blocks.items()}
        parts.append(_of_some(part, weights, confidence))
    return Estimates(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def _of_some(blocks: dict[str, np.ndarray], weights: np.ndarray, confidence: float) -> Estimates:
    a, b, ab = blocks["A"], blocks["B"], blocks["AB"]
    mean = weights @ (a + b) / 2
    variance = weights @ (a**2 + b**2) / 2 - mean**2
    some = variance > np.finfo(float).eps
    inverse = np.where(some, 1 / np.where(some, variance, 1.0), 0.0)[:, None]
    first = weighted(weights, b[:, None] * (ab - a[:, None])) * inverse
    total = weighted(weights, (a[:, None] - ab) ** 2) / 2 * inverse
    names, outputs = ab.shape[1:]
    wanted = names if "BA" in blocks else 0
    second, second_conf = np.full((2, outputs, wanted, wanted), np.nan)
    for j in range(wanted - 1):
        products = blocks["BA"][:, j, None] * ab[:, j + 1 :] - (a * b)[:, None]
        pair = weighted(weights, products) * inverse - first[:, j, None] - first[:, j + 1 :]
        second[:, j, j + 1 :], second_conf[:, j, j + 1 :] = with_interval(pair, confidence)
    return Estimates(*with_interval(first, confidence), *with_interval(total, confidence), second, second_conf)
