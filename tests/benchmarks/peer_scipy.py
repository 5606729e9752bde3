"""SciPy's `solve_ivp` from tick to tick, with finite differences, as an entrant."""

import math
from collections.abc import Sequence

import numpy as np
from scipy.integrate import solve_ivp

from tests.benchmarks.emps_case import COMMAND_LIMIT, PERIOD, POSITION_GAIN, VELOCITY_GAIN, Case
from tests.benchmarks.entrant import Entrant

RTOL, ATOL = 1e-6, 1e-9
METHODS = ("RK23", "RK45", "LSODA")
# LSODA's changes of order and step length make its differences noise.
DIFFERENTIABLE = ("RK23", "RK45")

# Small enough for the curvature, large enough for the integrator's noise.
_DIFFERENCE = 1e-4


def scipy_entrant(case: Case, method: str) -> Entrant:
    """`solve_ivp` with one method; the Jacobian is by forward differences, one more simulation per parameter."""
    return Entrant(
        f"SciPy solve_ivp {method}",
        "SciPy",
        simulate=lambda: _positions(case, case.vector, method),
        jacobian=(lambda: _differences(case, method)) if method in DIFFERENTIABLE else None,
    )


def _positions(case: Case, vector: Sequence[float], method: str) -> np.ndarray:
    # Plain floats: arrays of two numbers would slow the right-hand side down several times.
    values = case.values([float(x) for x in vector], math)
    state = list(case.start)
    previous = before = state[0]
    positions = []
    for wanted in case.wanted[:-1].tolist():
        position = state[0]
        positions.append(position)
        velocity = (position - before) / (2 * PERIOD)
        command = VELOCITY_GAIN * (POSITION_GAIN * (wanted - position) - velocity)
        command = min(max(command, -COMMAND_LIMIT), COMMAND_LIMIT)
        solution = solve_ivp(
            lambda t, y, command=command: case.rate(y.tolist(), command, values, math),
            (0.0, PERIOD),
            state,
            method=method,
            rtol=RTOL,
            atol=ATOL,
            first_step=PERIOD,  # spares it the search for a first step, a third of its time
        )
        state = solution.y[:, -1].tolist()
        previous, before = position, previous
    return np.array([*positions, state[0]])


def _differences(case: Case, method: str) -> np.ndarray:
    vector = case.vector
    at = _positions(case, vector, method)
    columns = []
    for i, x in enumerate(vector):
        moved = vector.copy()
        moved[i] = x + _DIFFERENCE * max(abs(x), 1e-3)
        columns.append((_positions(case, moved, method) - at) / (moved[i] - x))
    return np.stack(columns, axis=-1)
