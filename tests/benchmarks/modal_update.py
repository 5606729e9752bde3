"""Likeness of one mode to a reference mode, with its gradient, after a few springs have changed: with and without eigh.

The twin seeks the one mode by Rayleigh-quotient iteration (`fitting.identification.machine_likeness`). The peers solve
for all modes at every point, and take the one that is most like the reference: JAX with its derivative of `eigh`, and
SciPy with finite differences.
"""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from scipy.linalg import eigh

from fitting.identification.machine_likeness import PartData, unlikeness
from fitting.identification.machine_macxp import macxp_of_one_ratio
from tests.benchmarks.summary import SummaryRow, compared
from tests.benchmarks.swarm_cases import SMALL, ellinger_small_problem

GOAL = 16.0
"""Least ratio to JAX's eigh."""
LIMIT = 1e-5
"""Largest difference of values and gradients, relative to the largest."""
_STEP = 1e-6


def modal_update(points: int = 256, rounds: int = 5, differenced: int = 16) -> list[SummaryRow]:
    """Value and gradient at random points near the middle of the bounds.

    Args:
        points: number of points.
        rounds: turns of timing.
        differenced: points of the peer with finite differences.
    """
    data = ellinger_small_problem().residual.residual.data
    plain = jax.tree.map(np.asarray, data)
    shares = np.random.default_rng(1).uniform(0.3, 0.7, (points, SMALL))
    ours = jax.jit(jax.vmap(unlikeness, in_axes=(0, None)))
    theirs = jax.jit(jax.vmap(jax.value_and_grad(unlikeness_by_eigh), in_axes=(0, None)))
    # Where the iteration finds a neighbour, which callers notice and mend, there is nothing to compare.
    alike = np.abs(np.asarray(ours(shares, data)[0]) - np.asarray(theirs(shares, data)[0])) < LIMIT
    rows, few = shares[alike], shares[alike][:differenced]
    what = f"one mode and gradient over {SMALL} springs, {len(data.eigenvalues)} modes"
    return [
        compared(
            f"{what}; same mode in {100 * alike.mean():.0f} % of {points} points",
            "JAX eigh, batched",
            _together(theirs, rows, data),
            _together(ours, rows, data),
            limit=LIMIT,
            rounds=rounds,
            least=GOAL,
        ),
        compared(
            what,
            "SciPy eigh, differences",
            lambda: np.stack([_differenced(row, plain) for row in few]),
            _together(ours, few, data),
            limit=1e-3,
            rounds=rounds,
        ),
    ]


def unlikeness_by_eigh(share: Array, data: PartData, of: Any = jnp) -> Array:
    """1 - MACXP from all modes.

    Args:
        share: searched stiffnesses as shares of their ranges.
        data: the problem.
        of: `jax.numpy` or `numpy`.
    """
    change = (share - data.base)[data.owner] * data.weight
    values, shapes = (of.linalg.eigh if of is jnp else eigh)(
        of.diag(data.eigenvalues) + (data.vectors * change) @ data.vectors.T
    )
    mac = (data.cross @ shapes) ** 2 / of.sum(shapes * (data.gram @ shapes), axis=0)
    return 1 - of.max(macxp_of_one_ratio(mac, of.sqrt(of.abs(values)), data.omega, data.ratio))


def _together(function: Callable, rows: np.ndarray, data: PartData) -> Callable[[], np.ndarray]:
    def call() -> np.ndarray:
        value, slope = function(rows, data)
        return np.concatenate([np.asarray(value)[:, None], np.asarray(slope)], axis=1)

    return call


def _differenced(share: np.ndarray, data: PartData) -> np.ndarray:
    points = share + _STEP * np.vstack([np.zeros(SMALL), np.eye(SMALL)])
    value, *moved = (unlikeness_by_eigh(point, data, np) for point in points)
    return np.array([value, *((one - value) / _STEP for one in moved)])
