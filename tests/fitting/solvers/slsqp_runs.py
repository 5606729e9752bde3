"""Runs of SLSQP that the tests share: one program for each kind of problem."""

from typing import NamedTuple

import jax
import numpy as np
import optimistix as optx

from fitting.solvers.slsqp import SLSQP
from fitting.solvers.stop import STOPS
from tests.problems.programme_runs import QUICK


class Answer(NamedTuple):
    x: np.ndarray
    value: np.ndarray
    violation: np.ndarray
    reason: np.ndarray
    successful: np.ndarray
    steps: np.ndarray
    multipliers: np.ndarray

    @property
    def why(self) -> str:
        return STOPS[int(self.reason)]


def minimum(objective, equality, inequality, start, lower, upper, args, mode="fwd"):
    options = {"lower": lower, "upper": upper, "equality": equality, "inequality": inequality, "autodiff_mode": mode}
    found = optx.minimise(objective, SLSQP(), start, args=args, options=options, max_steps=200, throw=False)
    state = found.state
    successful = found.result == optx.RESULTS.successful
    reason = found.stats["reason"]._value
    return found.value, state.here.value, state.violation, reason, successful, state.steps, state.multipliers


_run = jax.jit(minimum, static_argnums=(0, 1, 2, 7), compiler_options=QUICK)


def solve_programme(*args) -> Answer:
    return Answer(*jax.tree.map(np.asarray, _run(*args)))
