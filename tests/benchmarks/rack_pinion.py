"""The preloaded rack-and-pinion drive: one run, many what-if variants, and the Jacobian of the torques.

Every entrant's error is measured against SciPy at tight tolerances. Ratios are of medians, taken between the fastest
entrants of either kind that are accurate enough; the limits are what the peers reach at a relative tolerance of 1e-6.
"""

import os
import shutil
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import diffrax
import numpy as np

from tests.benchmarks import rack_peers
from tests.benchmarks.entrant import Spread, time_interleaved
from tests.benchmarks.rack_case import nominal, variants
from tests.benchmarks.rack_loop import compiled_loop
from tests.benchmarks.rack_twin import twin_batch, twin_jacobian, twin_run
from twin.stepping import AbstractStepping, AdaptiveSteps, ConstantSteps

TWIN, CVODES, CVODES_COMPILED = "twin", "CasADi CVODES", "CasADi CVODES, compiled"
SCIPY, ODEINT, LOOP = "SciPy solve_ivp", "SciPy odeint", "C loop"
TORQUE_LIMIT = 2e-4
"""Largest error of a single run's torques, relative to the largest torque."""
BATCH_LIMIT = 3e-4
"""The same over the variants that are checked: some of them have more contacts to make."""
JACOBIAN_LIMIT = 4e-4
"""Largest error of the Jacobian, relative to each column's largest entry."""
VARIANTS = 256
WIDTH = 32
"""Variants that the twin runs in step."""

Run = Callable[[np.ndarray], np.ndarray]

SUBSTEPS = 17
"""Constant steps between saved times that are accurate enough for all variants."""

_CHECKED = 32
_SOLVERS = (diffrax.Dopri8(), diffrax.Tsit5(), diffrax.Bosh3())
# Constant steps are judged here against a solution, not by their own estimate, which is stricter at a contact.
_UNJUDGED = 1e9
_FUNCTIONAL = rack_peers.ADAMS | {"nonlinear_solver_iteration": "functional"}


@dataclass(frozen=True)
class Entry:
    """An entrant before it is timed."""

    role: str
    call: Callable[[], np.ndarray]
    build: float
    """Time that it took to set up [s]."""
    compiles: bool = False
    """Whether the first call compiles."""
    variants: int = 1
    """Variants of a call."""
    cores: int = 1


@dataclass(frozen=True)
class Row:
    """An entrant's result."""

    section: str
    name: str
    role: str
    cores: int
    variants: int
    spread: Spread
    """Times of calls [s]."""
    compile: float
    """Setting up and compilation [s]."""
    error: float
    """Torques: relative to the largest torque; Jacobian: relative to each column's largest entry."""
    position_error: float | None
    """Table position [m]; None for a Jacobian."""
    accurate: bool

    @property
    def each(self) -> float:
        """Median time per variant [s]."""
        return self.spread.median / self.variants


def all_rows(rounds: int) -> list[Row]:
    """Run everything.

    Args:
        rounds: turns of timing.
    """
    # Long calls get one timing a round.
    return [*_single(rounds), *_batch(2 * rounds), *_jacobian(2 * rounds)]


def _single(rounds: int) -> list[Row]:
    values = nominal()
    exact = rack_peers.reference(values)
    steppings: dict[str, AbstractStepping] = {
        f"{type(s).__name__}, rtol 1e-6": AdaptiveSteps(solver=s) for s in _SOLVERS
    }
    steppings |= _constant(10, 20)
    entries = {
        f"twin, {name}": _entry(TWIN, partial(twin_run, s), values, compiles=True) for name, s in steppings.items()
    }
    for method in ("RK23", "RK45", "LSODA"):
        entries[f"SciPy solve_ivp {method}"] = _entry(SCIPY, partial(rack_peers.scipy_run, method), values)
    entries["SciPy odeint"] = _entry(ODEINT, partial(rack_peers.scipy_run, "odeint"), values)
    for name, (role, options) in _cvodes({"BDF": rack_peers.BDF, "Adams": rack_peers.ADAMS}).items():
        entries[name] = _entry(role, partial(rack_peers.cvodes_run, options), values, compiles=True)
    return _rows("single run", entries, rounds, lambda answer: _errors(answer[None], exact[None]), TORQUE_LIMIT)


def _batch(rounds: int) -> list[Row]:
    values = variants(VARIANTS)
    tight = rack_peers.cvodes_run(rack_peers.BDF | {"reltol": 1e-10, "abstol": 1e-13, "max_num_steps": 100_000})
    exact = np.stack([tight(row) for row in values[:_CHECKED]])
    cores = sorted({1, os.cpu_count() or 1})
    entries = {}
    steppings = _constant(SUBSTEPS) | {"Tsit5, rtol 1e-6": AdaptiveSteps(solver=diffrax.Tsit5())}
    for name, stepping in steppings.items():
        for n in cores:
            make = partial(twin_batch, stepping, WIDTH, n)
            entries[f"twin, {name}, {_on(n)}"] = _entry(TWIN, make, values, compiles=True, variants=VARIANTS, cores=n)
    for steps in (12, 13, 16) if compiled_loop() else ():
        for n in cores:
            make = partial(_compiled, steps, n)
            entries[f"C, RK4, {steps} steps, {_on(n)}"] = _entry(LOOP, make, values, variants=VARIANTS, cores=n)
    for name, (role, options) in _cvodes({"BDF": rack_peers.BDF, "Adams": rack_peers.ADAMS}).items():
        entries[name] = _looped(role, partial(rack_peers.cvodes_run, options), values[:_CHECKED], compiles=True)
    for method, count in (("RK45", 4), ("LSODA", 8)):
        entries[f"SciPy solve_ivp {method}"] = _looped(SCIPY, partial(rack_peers.scipy_run, method), values[:count])
    entries["SciPy odeint"] = _looped(ODEINT, partial(rack_peers.scipy_run, "odeint"), values[:8])
    return _rows("variants", entries, rounds, lambda answer: _errors(answer, exact), BATCH_LIMIT)


def _jacobian(rounds: int) -> list[Row]:
    values = nominal()
    exact = rack_peers.reference_jacobian(values)
    steppings: dict[str, AbstractStepping] = {
        f"Dopri8, rtol {rtol}": AdaptiveSteps(rtol=float(rtol), atol=1e-3 * float(rtol))
        for rtol in ("1e-4", "1e-5", "1e-6")
    }
    steppings |= _constant(20)
    entries = {
        f"twin, {n}": _entry(TWIN, partial(twin_jacobian, s), values, compiles=True) for n, s in steppings.items()
    }
    for name, (role, options) in _cvodes({"BDF": rack_peers.BDF, "Adams, functional": _FUNCTIONAL}).items():
        entries[name] = _entry(role, partial(rack_peers.cvodes_jacobian, options), values, compiles=True)

    def errors(answer: np.ndarray) -> tuple[float, None]:
        return float(np.max(np.abs(answer - exact) / np.max(np.abs(exact), axis=0))), None

    return _rows("Jacobian", entries, rounds, errors, JACOBIAN_LIMIT)


def _constant(*substeps: int) -> dict[str, AbstractStepping]:
    return {f"Bosh3, {n} steps": ConstantSteps(substeps=n, rtol=_UNJUDGED) for n in substeps}


def _cvodes(settings: Mapping[str, dict]) -> dict[str, tuple[str, dict]]:
    """By name, role and options; the last setting also with its functions compiled as C."""
    found = {f"CasADi CVODES {name}": (CVODES, options) for name, options in settings.items()}
    compiler, (name, options) = shutil.which("cc"), list(settings.items())[-1]
    if compiler:
        compiled = {"jit": True, "compiler": "shell", "jit_options": {"compiler": compiler, "flags": ["-O2"]}}
        found[f"CasADi CVODES {name}, compiled C"] = (CVODES_COMPILED, options | compiled)
    return found


def _entry(role: str, make: Callable[[], Run], values: np.ndarray, **about: Any) -> Entry:
    begin = time.perf_counter()
    run = make()
    return Entry(role, lambda: run(values), time.perf_counter() - begin, **about)


def _compiled(steps: int, threads: int) -> Run:
    loop = compiled_loop()
    assert loop is not None
    return loop.runner(steps, threads)


def _looped(role: str, make: Callable[[], Run], values: np.ndarray, **about: Any) -> Entry:
    """One variant after another."""
    return _entry(role, lambda: _one_by_one(make()), values, variants=len(values), **about)


def _one_by_one(run: Run) -> Run:
    return lambda values: np.stack([run(row) for row in values])


def _on(cores: int) -> str:
    return "one core" if cores == 1 else f"{cores} cores"


def _errors(answer: np.ndarray, exact: np.ndarray) -> tuple[float, float]:
    """Largest errors of torques and position over the variants that both have."""
    count = min(len(answer), len(exact))
    found, wanted = answer[:count], exact[:count]
    off = np.abs(found - wanted)
    size = np.max(np.abs(wanted[..., 1:]), axis=1, keepdims=True)
    return float(np.max(off[..., 1:] / size)), float(np.max(off[..., 0]))


def _rows(
    section: str,
    entries: Mapping[str, Entry],
    rounds: int,
    errors: Callable[[np.ndarray], tuple[float, float | None]],
    limit: float,
) -> list[Row]:
    timings = time_interleaved(
        {name: (entry.call, entry.compiles) for name, entry in entries.items()},
        rounds,
        lambda _, answer: errors(answer)[0] <= limit,
    )
    rows = []
    for name, entry in entries.items():
        timing = timings[name]
        error, position = errors(timing.answer)
        rows.append(
            Row(
                section,
                name,
                entry.role,
                entry.cores,
                entry.variants,
                timing.spread,
                entry.build + timing.compile,
                error,
                position,
                error <= limit,
            )
        )
    return rows
