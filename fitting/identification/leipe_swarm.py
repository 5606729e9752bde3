"""What a particle swarm pays for the curve fits of Leipe et al., next to what gradients pay."""

from typing import Any

import numpy as np

from fitting.identification.leipe import SweepStudy
from fitting.identification.particle_swarm import SwarmResult, particle_swarm


def swarms(sweeps: SweepStudy) -> dict[str, tuple[SwarmResult, int]]:
    """What a swarm pays for the errors of the chain's curve fits, next to what the gradient fits paid.

    A gradient fit pays one evaluation for each residual and one more for each column of its Jacobian. The swarm stops
    as soon as its error is as small but for a part in a million.

    Args:
        sweeps: of which the exact chain's points are used.
    """
    used = [p for p in sweeps.exact.points if p.used and p.peak is not None]
    forces = np.abs(np.asarray([p.forces for p in used])).T
    found = {}
    for name, fit, field in (
        ("stiffness", sweeps.exact.stiffness, "stiffness"),
        ("damping", sweeps.exact.damping, "damping"),
    ):
        measured = np.asarray([getattr(p.peak, field) for p in used])
        law = _root if name == "stiffness" else _hyperbola
        values = fit.result.values

        def cost(places: np.ndarray, law: Any = law, measured: np.ndarray = measured) -> np.ndarray:
            errors = np.sum(law(np.exp(places), forces), axis=1) - measured
            return np.sqrt(np.sum(errors**2, axis=1) / np.sum(measured**2))  # eq. 5a

        middle = np.log(values)
        target = fit.error_percent / 100 * (1 + 1e-6)
        swarm = particle_swarm(cost, middle - np.log(30.0), middle + np.log(30.0), target=target)
        paid = (fit.result.steps + 1) * (len(values) + 1)
        found[name] = (swarm, paid)
    return found


def _root(p: np.ndarray, forces: np.ndarray) -> np.ndarray:
    """Eq. 3 for many particles: (particles, 2, points)."""
    return p[:, 0, None, None] * np.sqrt(forces**2 + 1.0) ** (1 / p[:, 1, None, None])


def _hyperbola(p: np.ndarray, forces: np.ndarray) -> np.ndarray:
    """Eq. 8 for many particles: (particles, 2, points)."""
    return p[:, 0, None, None] / (p[:, 1, None, None] + np.sqrt(forces**2 + 1.0)) + p[:, 2, None, None]
