"""The particle swarm that the gradient fits are compared with."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from twin._checks import InputError


class SwarmResult(NamedTuple):
    """What a swarm found."""

    values: np.ndarray
    """Best position (parameters,)."""
    cost: float
    """Cost there."""
    evaluations: int
    """Evaluations of the cost until it was first within the tolerance of the target, or in all."""
    reached: bool
    """Whether the target was reached."""


def particle_swarm(
    cost: Callable[[Float[np.ndarray, "particles parameters"]], Float[np.ndarray, "particles"]],
    lower: Float[np.ndarray, "parameters"],
    upper: Float[np.ndarray, "parameters"],
    *,
    target: float,
    particles: int = 40,
    rounds: int = 2000,
    seed: int = 1,
) -> SwarmResult:
    """Minimise a cost by a swarm, each particle drawn to its own best place and to that of all.

    J. Kennedy, R. Eberhart 1995, the reference [20] of Leipe et al., with the constriction coefficients of M. Clerc,
    J. Kennedy 2002 (0.7298, 1.4962), which need no tuning.

    Args:
        cost: costs of many positions at once; one that is not a number counts as infinite.
        lower: lower bounds.
        upper: upper bounds.
        target: cost at which to stop.
        particles: size of the swarm.
        rounds: moves at most.
        seed: of the random numbers.

    Raises:
        InputError: bounds that are not finite or reversed.
    """
    low, high = np.asarray(lower, dtype=float), np.asarray(upper, dtype=float)
    if not (np.all(np.isfinite(low)) and np.all(np.isfinite(high)) and np.all(low < high)):
        raise InputError(f"A swarm needs finite bounds, lower below upper, but has {low} and {high}. Give such bounds.")

    def costs(places: np.ndarray) -> np.ndarray:
        values = np.asarray(cost(places), dtype=float)
        return np.where(np.isnan(values), np.inf, values)

    random = np.random.default_rng(seed)
    place = random.uniform(low, high, (particles, low.size))
    speed = np.zeros_like(place)
    best, best_cost = place.copy(), costs(place)
    evaluations = particles
    for _ in range(rounds):
        leader = best[np.argmin(best_cost)]
        if np.min(best_cost) <= target:
            break
        own, common = random.random((2, *place.shape))
        speed = 0.7298 * speed + 1.4962 * (own * (best - place) + common * (leader - place))
        moved = place + speed
        place = np.clip(moved, low, high)
        speed = np.where(moved == place, speed, 0.0)
        new = costs(place)
        evaluations += particles
        better = new < best_cost
        best, best_cost = np.where(better[:, None], place, best), np.where(better, new, best_cost)
    winner = int(np.argmin(best_cost))
    return SwarmResult(best[winner], float(best_cost[winner]), evaluations, bool(best_cost[winner] <= target))
