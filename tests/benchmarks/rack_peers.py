"""SciPy and CasADi on the rack-and-pinion case, as their users would write it.

All functions take parameter values and return table position and both torques at the saved times, shape (times, 3).
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np
from scipy.integrate import odeint, solve_ivp

from tests.benchmarks.rack_case import (
    PARAMETERS,
    PATHS,
    STATES,
    TIMES,
    Segment,
    along,
    constants,
    motion,
    rate,
    segments,
    torques,
)

RTOL, ATOL = 1e-6, 1e-9
ADAMS = {"linear_multistep_method": "adams"}
BDF: dict[str, Any] = {}

_TINY = 1e-30


def reference(values: np.ndarray, rtol: float = 1e-12, method: str = "DOP853") -> np.ndarray:
    """What the drive does, by SciPy at a tight tolerance.

    Args:
        values: parameters.
        rtol: relative tolerance; the absolute one is a tenth of it.
        method: of `solve_ivp`.
    """
    return scipy_run(method, rtol, rtol / 10)(values)


def reference_jacobian(values: np.ndarray, rtol: float = 1e-9) -> np.ndarray:
    """Derivative of the torques along relative changes of the parameters, by the variational equations.

    Integrated with the state and under the same error control; their right-hand side is the imaginary part of that of
    the drive, a tiny step into the complex plane.

    Args:
        values: parameters.
        rtol: relative tolerance.

    Returns:
        Shape (times, 2, parameters) [Nm].
    """
    moved = np.tile(values[:, None].astype(complex), (1, PARAMETERS))
    moved[:PARAMETERS] += 1j * _TINY * np.diag(values[:PARAMETERS])
    given = constants(moved)

    def lifted(y: np.ndarray) -> np.ndarray:
        parts = y.reshape(STATES, 1 + PARAMETERS)
        return parts[:, :1] + 1j * _TINY * parts[:, 1:]

    def lowered(rows: np.ndarray) -> np.ndarray:
        return np.concatenate([rows[:, :1].real, rows.imag / _TINY], axis=1)

    state, found = np.zeros(STATES * (1 + PARAMETERS)), [np.zeros((1, 2, PARAMETERS))]
    for stretch in segments():

        def rates(t: float, y: np.ndarray, stretch: Segment = stretch) -> np.ndarray:
            return np.ravel(lowered(np.asarray(rate(lifted(y), stretch.point(t), given, np.sqrt))))

        solution = _solve(rates, stretch, state, "DOP853", rtol, rtol * 1e-3)
        times = TIMES[_saved(stretch)]
        rows = [torques(lifted(y), stretch.point(t), given, np.sqrt) for t, y in zip(times, solution.T, strict=True)]
        found.append(np.asarray(rows)[1:].imag / _TINY)
        state = solution[:, -1]
    return np.concatenate(found)


def scipy_run(method: str, rtol: float = RTOL, atol: float = ATOL) -> Callable[[np.ndarray], np.ndarray]:
    """`solve_ivp`, or `odeint` (LSODA without Python between the steps), started anew at every knot.

    Args:
        method: of `solve_ivp`, or "odeint".
        rtol: relative tolerance.
        atol: absolute tolerance.
    """
    stretches, wanted = segments(), motion(TIMES)

    def run(values: np.ndarray) -> np.ndarray:
        # Plain floats: arrays of a few numbers would slow the right-hand side down several times.
        given = constants(values.tolist())
        state, rows = np.zeros(STATES), [np.zeros((1, STATES))]
        for stretch in stretches:

            def rates(t: float, y: np.ndarray, stretch: Segment = stretch) -> list:
                return rate(y.tolist(), stretch.point(t), given, math.sqrt)

            if method == "odeint":
                times, tolerances = TIMES[_saved(stretch)], {"rtol": rtol, "atol": atol}
                solution = odeint(rates, state, times, tfirst=True, tcrit=[stretch.end], **tolerances).T
            else:
                solution = _solve(rates, stretch, state, method, rtol, atol)
            rows.append(solution.T[1:])
            state = solution[:, -1]
        return _observed(np.concatenate(rows).T, wanted, given)

    return run


def cvodes_run(options: dict[str, Any]) -> Callable[[np.ndarray], np.ndarray]:
    """CVODES over the whole run, told of the knots; its right-hand side gets what depends on parameters alone.

    Args:
        options: of the integrator, besides the tolerances.
    """
    integrate, wanted = _integrator(options), motion(TIMES)
    start, controls = np.zeros(STATES), _controls()

    def run(values: np.ndarray) -> np.ndarray:
        given = constants(values.tolist())
        found = integrate(x0=start, p=given, u=controls)["xf"].full()
        return _observed(np.hstack([start[:, None], found]), wanted, given)

    return run


def cvodes_jacobian(options: dict[str, Any]) -> Callable[[np.ndarray], np.ndarray]:
    """Forward sensitivities of CVODES, from parameters to torques along relative changes.

    Args:
        options: of the integrator, besides the tolerances.
    """
    state, wanted, given = ca.SX.sym("x", STATES), ca.SX.sym("w", 3), ca.SX.sym("g", 22)
    observed = torques(ca.vertsplit(state), ca.vertsplit(wanted), ca.vertsplit(given), ca.sqrt)
    observe = ca.Function("observe", [state, wanted, given], [ca.vertcat(*observed)])

    relative, values = ca.MX.sym("relative", PARAMETERS), ca.MX.sym("values", len(PATHS))
    varied = values * ca.vertcat(relative, 1.0)
    symbols = ca.SX.sym("p", len(PATHS))
    derive = ca.Function("derive", [symbols], [ca.vertcat(*constants(ca.vertsplit(symbols)))])
    found = _integrator(options)(x0=ca.DM.zeros(STATES), p=derive(varied), u=_controls())["xf"]
    rows = observe.map(TIMES.size - 1)(found, ca.DM(motion(TIMES)[1:].T), ca.repmat(derive(varied), 1, TIMES.size - 1))
    along_all = ca.jtimes(rows, relative, ca.MX.eye(PARAMETERS))
    jacobian = ca.Function("jacobian", [relative, values], [along_all])
    ones = np.ones(PARAMETERS)

    def run(values: np.ndarray) -> np.ndarray:
        parts = jacobian(ones, values).full().reshape(2, PARAMETERS, TIMES.size - 1)
        return np.concatenate([np.zeros((1, 2, PARAMETERS)), np.transpose(parts, (2, 0, 1))])

    return run


def _integrator(options: dict[str, Any]) -> ca.Function:
    state, given, segment, t = ca.SX.sym("x", STATES), ca.SX.sym("g", 22), ca.SX.sym("s", 5), ca.SX.sym("t")
    wanted = along(t - segment[0], ca.vertsplit(segment[1:]))
    rates = rate(ca.vertsplit(state), wanted, ca.vertsplit(given), ca.sqrt)
    problem = {"x": state, "p": given, "u": segment, "t": t, "ode": ca.vertcat(*rates)}
    return ca.integrator("integrate", "cvodes", problem, 0.0, TIMES[1:], {"reltol": RTOL, "abstol": ATOL} | options)


def _controls() -> np.ndarray:
    """The segment of every stretch between saved times: CasADi stops only where it changes, shape (5, times - 1)."""
    columns = [[s.begin, *s.start] for s in segments() for _ in _saved(s)[1:]]
    return np.asarray(columns).T


def _observed(states: Any, wanted: np.ndarray, given: Sequence[float]) -> np.ndarray:
    return np.stack([states[2], *torques(states, wanted.T, given, np.sqrt)], axis=-1)


def _solve(rates: Callable, stretch: Segment, state: np.ndarray, method: str, rtol: float, atol: float) -> np.ndarray:
    times = np.clip(TIMES[_saved(stretch)], stretch.begin, stretch.end)
    return solve_ivp(rates, (stretch.begin, stretch.end), state, method=method, t_eval=times, rtol=rtol, atol=atol).y


def _saved(stretch: Segment) -> np.ndarray:
    """Numbers of the saved times in a stretch, its ends included."""
    period = TIMES[1]
    return np.arange(round(stretch.begin / period), round(stretch.end / period) + 1)
