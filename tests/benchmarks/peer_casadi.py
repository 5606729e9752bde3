"""CasADi as an entrant: its CVODES with its own forward sensitivities, and its fixed-step Runge-Kutta method."""

import contextlib
import shutil
import tempfile
import time
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from tests.benchmarks.emps_case import COMMAND_LIMIT, PERIOD, POSITION_GAIN, VELOCITY_GAIN, Case
from tests.benchmarks.entrant import Entrant
from tests.benchmarks.peer_scipy import ATOL, RTOL

_TOLERANCES = {"reltol": RTOL, "abstol": ATOL}
CVODES = {
    "BDF, Newton": _TOLERANCES,
    "Adams, functional": {
        **_TOLERANCES,
        "linear_multistep_method": "adams",
        "nonlinear_solver_iteration": "functional",
    },
    "Adams, functional, first step 1 tick": {
        **_TOLERANCES,
        "linear_multistep_method": "adams",
        "nonlinear_solver_iteration": "functional",
        "step0": PERIOD,
    },
}


def cvodes_entrants(case: Case, setting: str) -> list[Entrant]:
    """CVODES from tick to tick, with each way that CasADi has to the sensitivities of all ticks."""
    tick = _tick(case, "cvodes", CVODES[setting])
    ways = {"forward mode of mapaccum": _forward, "mapaccum of forward mode": _augmented}
    return [_entrant(f"CasADi CVODES ({setting}), {way}", "CasADi CVODES", case, tick, ways[way]) for way in ways]


def runge_kutta_entrant(case: Case, steps: int, role: str) -> Entrant:
    """CasADi's RK4 of constant steps per tick, expanded to scalar operations, run by its virtual machine."""
    return _entrant(f"CasADi RK4, {steps} per tick", role, case, _runge_kutta(case, steps), _augmented)


def compiled_runge_kutta_entrant(case: Case, steps: int, role: str) -> Entrant | None:
    """The same, generated as C and compiled; None without a C compiler."""
    compiler = shutil.which("gcc")
    if compiler is None:
        return None
    options = {
        "jit": True,
        "compiler": "shell",
        "jit_options": {"compiler": compiler, "flags": ["-O3", "-march=native"]},
    }
    name = f"CasADi RK4, {steps} per tick, compiled C"
    # CasADi writes its sources into the working folder, and removes them when the function is gone.
    with contextlib.chdir(tempfile.gettempdir()):
        return _entrant(name, role, case, _runge_kutta(case, steps), _augmented, options)


def _tick(case: Case, plugin: str, options: dict) -> ca.Function:
    """(memory, wanted, vector) -> memory, where the memory is the state and the last two encoder positions."""
    count = len(case.start)
    state, command, vector = ca.SX.sym("x", count), ca.SX.sym("u"), ca.SX.sym("p", case.vector.size)
    rate = case.rate(ca.vertsplit(state), command, case.values(ca.vertsplit(vector), ca), ca)
    problem = {"x": state, "u": command, "p": vector, "ode": ca.vertcat(*rate)}
    integrate = ca.integrator("integrate", plugin, problem, 0.0, PERIOD, options)

    memory, wanted, vector = ca.MX.sym("memory", count + 2), ca.MX.sym("wanted"), ca.MX.sym("p", case.vector.size)
    position, previous, before = memory[0], memory[count], memory[count + 1]
    velocity = (position - before) / (2 * PERIOD)
    asked = VELOCITY_GAIN * (POSITION_GAIN * (wanted - position) - velocity)
    limited = ca.fmin(ca.fmax(asked, -COMMAND_LIMIT), COMMAND_LIMIT)
    after = integrate(x0=memory[:count], u=limited, p=vector)["xf"]
    return ca.Function("tick", [memory, wanted, vector], [ca.vertcat(after, position, previous)])


def _runge_kutta(case: Case, steps: int) -> ca.Function:
    return _tick(case, "rk", {"number_of_finite_elements": steps, "simplify": True}).expand()


def _forward(tick: ca.Function, case: Case, options: dict) -> Callable[[], np.ndarray]:
    """All directions at once through the recursion over the ticks."""
    steps, count = case.ticks - 1, case.vector.size
    run = tick.mapaccum("run", steps)
    arguments = _arguments(case, _start(case))
    along = run.forward(count)
    still = ca.DM(tick.size1_in(0), count), ca.DM(1, count * steps)
    seeds = ca.horzcat(*[ca.repmat(ca.DM.eye(count)[:, i], 1, steps) for i in range(count)])

    def jacobian() -> np.ndarray:
        rows = along(*arguments, run(*arguments), *still, seeds)[0, :].full().reshape(count, steps)
        return np.vstack([np.zeros(count), rows.T])

    return jacobian


def _augmented(tick: ca.Function, case: Case, options: dict) -> Callable[[], np.ndarray]:
    """One recursion over the memory and its sensitivities, which each tick propagates by its forward mode."""
    size, count = tick.size1_in(0), case.vector.size
    both, wanted, vector = ca.MX.sym("both", size * (1 + count)), ca.MX.sym("wanted"), ca.MX.sym("p", count)
    memory, sensitivity = both[:size], ca.reshape(both[size:], size, count)
    after = tick(memory, wanted, vector)
    along = tick.forward(count)(memory, wanted, vector, after, sensitivity, ca.DM(1, count), ca.DM.eye(count))
    step = ca.Function("step", [both, wanted, vector], [ca.veccat(after, along)])
    if _scalar_operations(tick):
        step = step.expand()
    # Of the sensitivities, those of the position.
    run = _over_ticks(step, slice(size, None, size), case, options)
    start = np.concatenate([_start(case), np.zeros(size * count)])

    def jacobian() -> np.ndarray:
        rows = run(start, case.wanted[:-1], case.vector).full()
        return np.vstack([np.zeros(count), rows.T])

    return jacobian


def _over_ticks(step: ca.Function, rows: Any, case: Case, options: dict) -> ca.Function:
    """(start, wanted, vector) -> some rows of what the steps return."""
    steps = case.ticks - 1
    start, wanted = ca.MX.sym("start", step.size1_in(0)), ca.MX.sym("wanted", 1, steps)
    vector = ca.MX.sym("p", case.vector.size)
    result = step.mapaccum("over_ticks", steps)(start, wanted, ca.repmat(vector, 1, steps))
    return ca.Function("run", [start, wanted, vector], [result[rows, :]], options)


def _entrant(
    name: str, role: str, case: Case, tick: ca.Function, way: Callable[..., Any], options: dict | None = None
) -> Entrant:
    begin = time.perf_counter()
    run = _over_ticks(tick, 0, case, options or {})
    jacobian = way(tick, case, options or {})
    build = time.perf_counter() - begin
    start = _start(case)

    def simulate() -> np.ndarray:
        positions = run(start, case.wanted[:-1], case.vector).full().ravel()
        return np.concatenate([[case.start[0]], positions])

    return Entrant(name, role, simulate, jacobian, build)


def _start(case: Case) -> np.ndarray:
    return np.array([*case.start, case.start[0], case.start[0]])


def _arguments(case: Case, start: np.ndarray) -> tuple:
    return start, case.wanted[:-1], ca.repmat(ca.DM(case.vector), 1, case.ticks - 1)


def _scalar_operations(tick: ca.Function) -> bool:
    return tick.is_a("SXFunction")
