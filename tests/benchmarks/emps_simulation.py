"""One simulation of the EMPS axis under its sampled controller, and one Jacobian over all parameters.

Every entrant integrates from tick to tick with the command held, as the controller holds it. Its positions and its
Jacobian are first compared with those of a method and a code of their own (CasADi's RK4 with many steps per tick); who
differs is shown, but neither timed further nor compared.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from tests.benchmarks import peer_casadi
from tests.benchmarks.emps_case import Case
from tests.benchmarks.entrant import Entrant, Timing, time_interleaved
from tests.benchmarks.peer_scipy import METHODS, scipy_entrant
from tests.benchmarks.peer_twin import twin_entrant

TWIN, SCIPY, CVODES = "twin", "SciPy", "CasADi CVODES"
TWIN_COARSE = "twin, one step per tick"
RK4, RK4_COMPILED = "CasADi RK4", "CasADi RK4, compiled C"
_PEERS = (SCIPY, CVODES, RK4, RK4_COMPILED)

# What tolerances of 1e-6 and 1e-9 at every tick leave after thousands of ticks. The limits are as wide as the peers
# need; the tests hold the twin to be more accurate than the peer that it is compared with.
POSITION_LIMIT = 2e-6
JACOBIAN_LIMIT = 5e-3

_EXACT_STEPS = 16


@dataclass(frozen=True)
class Row:
    """One entrant's results."""

    entrant: Entrant
    simulation: Timing
    """The simulation."""
    jacobian: Timing | None
    """The Jacobian; None where the entrant has none."""
    position_error: float
    """Largest difference from the exact positions [m]."""
    jacobian_error: float
    """Largest difference from the exact Jacobian, each column relative to its largest entry [-]."""

    @property
    def right_simulation(self) -> bool:
        """Whether the positions agree."""
        return self.position_error <= POSITION_LIMIT

    @property
    def right_jacobian(self) -> bool:
        """Whether there is a Jacobian, and it agrees."""
        return self.jacobian is not None and self.jacobian_error <= JACOBIAN_LIMIT


@dataclass(frozen=True)
class Comparison:
    """All entrants on one case."""

    case: Case
    rows: list[Row]

    def best_simulation(self, role: str) -> Row | None:
        """The fastest right simulation of a role, by its shortest call."""
        rows = [r for r in self.rows if r.entrant.role == role and r.right_simulation]
        return min(rows, key=lambda r: r.simulation.spread.min, default=None)

    def best_jacobian(self, role: str) -> Row | None:
        """The fastest right Jacobian of a role, by its shortest call."""
        rows = [r for r in self.rows if r.entrant.role == role and r.right_jacobian]
        return min(rows, key=lambda r: r.jacobian.spread.min, default=None)

    def ratios(self) -> dict[str, float]:
        """How many times longer than the twin a peer takes, by what is compared; each by its shortest calls."""
        ratios = {}
        for kind, role, theirs, ours in self.pairs():
            spreads = [(row.jacobian if kind == "Jacobian" else row.simulation).spread for row in (theirs, ours)]
            ratios[f"{role} / twin, {kind}"] = spreads[0].min / spreads[1].min
        return ratios

    def pairs(self) -> list[tuple[str, str, Row, Row]]:
        """What is compared, with whom, the fastest right entrants of the peer and of the twin."""
        found = []
        for role in _PEERS:
            for kind, best in (("simulation", self.best_simulation), ("Jacobian", self.best_jacobian)):
                ours, theirs = best(TWIN), best(role)
                if ours and theirs:
                    found.append((kind, role, theirs, ours))
        return found


def compare(case: Case, *, rounds: int = 3, scipy_methods: Iterable[str] = METHODS, extras: bool = True) -> Comparison:
    """Check and time all entrants on one case.

    Args:
        case: the axis and the reference.
        rounds: turns of timing.
        scipy_methods: methods of `solve_ivp` to try.
        extras: take also what is not needed for the comparison: the twin with its coarsest steps, CasADi with constant
            steps.

    Returns:
        A row for every entrant.
    """
    return _compare(case, _entrants(case, scipy_methods, extras), rounds)


def compare_best(case: Case, earlier: Comparison, *, rounds: int = 3) -> Comparison:
    """Check and time on another case, of the peers only those that were the fastest right ones earlier.

    Args:
        case: the axis and the reference, as a rule the earlier one's whole record.
        earlier: the comparison that tells who was fastest.
        rounds: turns of timing.
    """
    rows = [best(role) for role in (SCIPY, CVODES) for best in (earlier.best_simulation, earlier.best_jacobian)]
    names = {row.entrant.name for row in rows if row}
    methods = [m for m in METHODS if any(name.endswith(m) for name in names)]
    entrants = [e for e in _entrants(case, methods, True) if e.role not in (SCIPY, CVODES) or e.name in names]
    return _compare(case, entrants, rounds)


def _entrants(case: Case, scipy_methods: Iterable[str], extras: bool) -> list[Entrant]:
    entrants = [twin_entrant(case, case.substeps, TWIN)]
    entrants += [scipy_entrant(case, method) for method in scipy_methods]
    entrants += [e for setting in peer_casadi.CVODES for e in peer_casadi.cvodes_entrants(case, setting)]
    if extras:
        entrants.append(twin_entrant(case, 1, TWIN_COARSE))
        entrants.append(peer_casadi.runge_kutta_entrant(case, 1, RK4))
        compiled = peer_casadi.compiled_runge_kutta_entrant(case, 1, RK4_COMPILED)
        entrants += [compiled] if compiled else []
    return entrants


def _compare(case: Case, entrants: list[Entrant], rounds: int) -> Comparison:
    exact = peer_casadi.runge_kutta_entrant(case, _EXACT_STEPS, "exact")
    positions, jacobian = exact.simulate(), exact.jacobian()

    simulations = time_interleaved(
        {e.name: (e.simulate, e.compiles) for e in entrants},
        rounds,
        lambda _, answer: _position_error(answer, positions) <= POSITION_LIMIT,
    )
    jacobians = time_interleaved(
        {e.name: (e.jacobian, e.compiles) for e in entrants if e.jacobian},
        rounds,
        lambda _, answer: _jacobian_error(answer, jacobian) <= JACOBIAN_LIMIT,
    )
    row = partial(_row, simulations=simulations, jacobians=jacobians, positions=positions, exact=jacobian)
    return Comparison(case, [row(e) for e in entrants])


def _row(
    entrant: Entrant,
    *,
    simulations: Mapping[str, Timing],
    jacobians: Mapping[str, Timing],
    positions: np.ndarray,
    exact: np.ndarray,
) -> Row:
    simulation, jacobian = simulations[entrant.name], jacobians.get(entrant.name)
    return Row(
        entrant,
        simulation,
        jacobian,
        _position_error(simulation.answer, positions),
        float("nan") if jacobian is None else _jacobian_error(jacobian.answer, exact),
    )


def _position_error(answer: np.ndarray, exact: np.ndarray) -> float:
    return float(np.max(np.abs(answer - exact)))


def _jacobian_error(answer: np.ndarray, exact: np.ndarray) -> float:
    return float(np.max(np.abs(answer - exact) / np.max(np.abs(exact), axis=0)))
