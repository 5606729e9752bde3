"""What a particle swarm pays for a curve fit that gradients have made."""

import numpy as np
from jaxtyping import ArrayLike, Float

from fitting.identification.load_surface import LoadSurfaceFit
from fitting.identification.particle_swarm import SwarmResult, particle_swarm
from twin.laws import RootStiffness

# How far the swarm may look on either side of the answer, as a factor.
_REACH = 30.0


def swarm_price(
    found: LoadSurfaceFit, forces: Float[ArrayLike, "contacts points"], measured: Float[ArrayLike, "points"]
) -> tuple[SwarmResult, int]:
    """What a swarm pays for the error of a curve fit (Leipe et al., eq. 5), and what the gradient fit paid.

    A gradient fit pays one evaluation for each residual and one more for each column of its Jacobian, and for its
    start: a straight line, or a linear problem at each of nine d2. The swarm looks
    between a thirtieth and thirty times the answer, and stops as soon as its error is as small but for a part in a
    million.

    Args:
        found: the gradient fit of k(F) or d(F).
        forces: the motor forces that it was given [N].
        measured: the totals that it was given, SI.

    Returns:
        The swarm's result and the evaluations of the gradient fit.
    """
    law = _root if isinstance(found.law, RootStiffness) else _hyperbola
    magnitude = np.sqrt(np.asarray(forces, dtype=float) ** 2 + float(found.law.width) ** 2)
    totals = np.asarray(measured, dtype=float)

    result = found.result
    # What is at zero has no logarithm: it is looked for between zero and the mean total.
    positive = np.asarray(result.values) > 0
    middle, reach = np.log(np.where(positive, result.values, 1.0)), np.log(_REACH)
    lower = np.where(positive, middle - reach, 0.0)
    upper = np.where(positive, middle + reach, np.mean(totals))

    def cost(places: np.ndarray) -> np.ndarray:
        parameters = np.where(positive, np.exp(np.where(positive, places, 0.0)), places)
        errors = np.sum(law(parameters[..., None, None], magnitude), axis=1) - totals
        return np.sqrt(np.sum(errors**2, axis=1) / np.sum(totals**2))  # eq. 5a

    swarm = particle_swarm(cost, lower, upper, target=found.error_percent / 100 * (1 + 1e-6))
    start = 1 if law is _root else 9
    return swarm, start + (result.steps + 1) * (len(result.values) + 1)


def _root(p: np.ndarray, magnitude: np.ndarray) -> np.ndarray:
    """Eq. 3 for many particles (particles, contacts, points)."""
    return p[:, 0] * magnitude ** (1 / p[:, 1])


def _hyperbola(p: np.ndarray, magnitude: np.ndarray) -> np.ndarray:
    """Eq. 8 for many particles (particles, contacts, points)."""
    return p[:, 0] / (p[:, 1] + magnitude) + p[:, 2]
