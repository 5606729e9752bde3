"""slsqp-jax, the other SLSQP on JAX, on one programme from some starts: both as one compiled batch.

It is meant for thousands of variables. With 100 starts in a batch it has been seen to hang on two cores, so there are
few.
"""

import importlib.util
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jax import Array

from fitting.solvers.slsqp import SLSQP
from tests.benchmarks.summary import SummaryRow, compared, refused_row
from tests.problems.nonlinear_programme import NonlinearProgramme

LIMIT = 0.1
"""Largest share of starts from which it ends at another value."""
_SAME = 1e-6


def slsqp_jax_row(problem: NonlinearProgramme, starts: int = 20, rounds: int = 3) -> SummaryRow:
    """The peer's time over ours; refused if it does not end where ours does.

    Args:
        problem: with inequalities and bounds, without equalities.
        starts: drawn within the bounds.
        rounds: turns of timing.
    """
    what, peer = f"{problem.name} from {starts} starts", "slsqp-jax, one batch (agreement: share that ends elsewhere)"
    if importlib.util.find_spec("slsqp_jax") is None:
        return refused_row(what, peer, "not installed: take the bench extra")
    points = np.random.default_rng(1).uniform(problem.lower, problem.upper, (starts, problem.start.size))
    try:
        calls = _theirs(problem, points), _ours(problem, points)
        return compared(what, peer, *calls, limit=LIMIT, error=_elsewhere, rounds=rounds)
    except Exception as error:  # a peer that fails is told of, and ends no run
        return refused_row(what, peer, f"{type(error).__name__}: {str(error).splitlines()[0][:80]}")


def _elsewhere(theirs: np.ndarray, ours: np.ndarray) -> float:
    """Share of least values that are not alike; minimisers may be several."""
    return float(np.mean(~(np.abs(theirs - ours) <= _SAME * np.maximum(1.0, np.abs(ours)))))


def _ours(problem: NonlinearProgramme, points: np.ndarray) -> Callable[[], np.ndarray]:
    options = {
        "lower": problem.lower,
        "upper": problem.upper,
        "inequality": lambda y, args: _inequality(problem, y),
    }
    return _batch(lambda y, args: problem.objective(y), SLSQP(), points, options=options)


def _theirs(problem: NonlinearProgramme, points: np.ndarray) -> Callable[[], np.ndarray]:
    from slsqp_jax import SLSQP as Peer
    from slsqp_jax import SLSQPConfig, ToleranceConfig

    solver = Peer(
        ineq_constraint_fn=lambda y, args: _inequality(problem, y),
        n_ineq_constraints=_inequality(problem, jnp.asarray(problem.start)).size,
        bounds=jnp.stack([jnp.asarray(problem.lower), jnp.asarray(problem.upper)], axis=1),
        config=SLSQPConfig(tolerance=ToleranceConfig(rtol=1e-8)),
    )
    return _batch(lambda y, args: (problem.objective(y), None), solver, points, has_aux=True)


def _inequality(problem: NonlinearProgramme, y: Array) -> Array:
    if problem.inequality is None:
        raise ValueError(f"{problem.name} has no inequality.")
    return jnp.atleast_1d(jnp.asarray(problem.inequality(y)))


def _batch(objective: Callable, solver: Any, points: np.ndarray, **settings: Any) -> Callable[[], np.ndarray]:
    def solve(start: Array) -> Array:
        found = optx.minimise(objective, solver, start, max_steps=200, throw=False, **settings).value
        return jnp.asarray(jax.tree.leaves(objective(found, None))[0])

    batch = jax.jit(jax.vmap(solve))
    return lambda: np.asarray(batch(points))
