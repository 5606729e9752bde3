"""How the noise of measured responses depends on their size, told from what modes leave of them.

A response that is averaged over taps or sweeps errs by a share of its size (scatter of the excitation, coherence below
one) besides what the sensors add everywhere. Of each response the variance is taken as

    v = a + b·|H|²

with the a and b of maximum likelihood for residuals that are normal and circular. A b that the residuals do not ask
for is zero: a response whose noise is the same at all lines keeps even weights.

Source of the likelihood: J. Schoukens, R. Pintelon, "Identification of Linear Systems", Pergamon 1991, ch. 3 (noise on
the input appears as noise that grows with the response).
"""

import numpy as np
from jaxtyping import Complex, Float
from scipy.optimize import minimize

# The share of noise that does not grow is not believed to be smaller than this share of the mean.
_LEAST = 1e-6
# By how much the logarithm of the likelihood must rise for b to be believed, in units of the logarithm of the lines.
_ASKED = 2.0


def noise_deviation(
    residual: Complex[np.ndarray, "outputs inputs frequencies"],
    response: Complex[np.ndarray, "outputs inputs frequencies"],
) -> Float[np.ndarray, "outputs inputs frequencies"]:
    """Standard deviation of the real and of the imaginary part of each response at each line.

    Args:
        residual: measured responses minus those of the modes.
        response: those of the modes.

    Returns:
        The deviation: the same at all lines where the residuals do not grow with the response.
    """
    found = np.empty(residual.shape)
    for at in np.ndindex(*residual.shape[:2]):
        found[at] = np.sqrt(_variance(np.abs(residual[at]) ** 2, np.abs(response[at]) ** 2) / 2)
    return found


def _variance(power: np.ndarray, size: np.ndarray) -> np.ndarray:
    mean = float(np.mean(power))
    even = np.full(power.shape, mean)
    if mean == 0.0 or not np.any(size):
        return even
    size = size / np.mean(size)

    def cost(logarithms: np.ndarray) -> tuple[float, np.ndarray]:
        a, b = np.exp(logarithms)
        variance = a + b * size
        slope = 1 / variance - power / mean / variance**2
        return (
            float(np.sum(np.log(variance) + power / mean / variance)),
            np.array([a * np.sum(slope), b * np.sum(slope * size)]),
        )

    bounds = [(np.log(_LEAST), np.log(10.0)), (np.log(_LEAST), np.log(10.0))]
    starts = ([np.log(0.9), np.log(0.1)], [np.log(0.1), np.log(0.9)])
    best = min((minimize(cost, one, jac=True, bounds=bounds, method="L-BFGS-B") for one in starts), key=lambda r: r.fun)
    if power.size - best.fun < _ASKED * np.log(power.size):
        return even
    a, b = np.exp(best.x)
    return mean * (a + b * size)
