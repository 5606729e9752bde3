"""A machine identified as published: sensitivities part the problem, small problems are solved, damping is linear.

Source: section 2.3 of J. Ellinger, M. F. Zaeh, Machines 10 (2022) 535.
"""

import itertools
import time
from collections.abc import Sequence
from typing import NamedTuple

from fitting.identification.machine_damping import DampingEstimate, damping_least_squares, least_disturbed
from fitting.identification.machine_evidence import evidence
from fitting.identification.machine_part_runs import PartRuns
from fitting.identification.machine_parts import require_starts, solve_parts
from fitting.identification.machine_selection import PAPER, StiffnessSelection, require_rule, select_stiffness
from fitting.identification.machine_sensitivity import MachineSensitivity, machine_sensitivity
from fitting.identification.machine_unknowns import unknowns
from sensitivity.partition import require_threshold
from twin._checks import InputError
from twin.modal import ReferenceModes
from twin.parameters import ParameterSpace
from twin.structure import Machine


class Seconds(NamedTuple):
    """Time that the steps took, with compilation where the process had not compiled them before [s]."""

    sensitivity: float
    """Sensitivity study."""
    parts: float
    """Small problems."""
    rest: float
    """Selection and damping."""


class ByRule(NamedTuple):
    """What one rule of selection makes of the runs."""

    selection: StiffnessSelection
    """Stiffnesses, and the problems that they come from."""
    damping: DampingEstimate
    """Dampings that follow."""
    machine: Machine
    """The machine with both."""


class GuidedIdentification(NamedTuple):
    """A machine identified as published, with all that led to it."""

    sensitivity: MachineSensitivity
    """Sobol indices, which part the problem."""
    runs: PartRuns
    """All runs of the small problems."""
    chosen: ByRule
    """Stiffnesses and dampings."""
    seconds: Seconds
    """Time taken."""

    @property
    def machine(self) -> Machine:
        """The identified machine."""
        return self.chosen.machine

    @property
    def missing(self) -> tuple[str, ...]:
        """Paths of the stiffnesses that no mode tells; they stayed as they were."""
        return self.chosen.selection.missing


def identify_by_parts(
    machine: Machine,
    references: Sequence[ReferenceModes],
    positions: Sequence[float],
    space: ParameterSpace,
    *,
    seed: int,
    n: int = 1024,
    starts: int = 100,
    threshold: float = 0.01,
    rule: str = PAPER,
    equations: int | None = 20,
    least: float = 0.005,
    threads: int | None = None,
) -> GuidedIdentification:
    """Identify a machine's joints by many small problems, without a good start and without choices by hand.

    A Sobol study of all MACXP and NDD² says which parameters move which mode; each mode's few stiffnesses are searched
    from many random starts; of each stiffness the problem is believed whose runs agree most; and damping ratios,
    which are linear in the dampers, give these.

    Args:
        machine: machine; of its values of the unknown parameters those stiffnesses stay that no mode tells, see
            `GuidedIdentification.missing`; the others play no part.
        references: reference modes, one set for each position.
        positions: axis positions [m].
        space: unknown stiffnesses and dampings of joints, with bounds, on a linear scale for starts that are uniform.
        seed: of samples and starts, from 1.
        n: base points of the sensitivity study, a power of two.
        starts: runs of each small problem.
        threshold: total effect above which a stiffness is searched.
        rule: how runs are chosen, see `select_stiffness`.
        equations: damping ratios used: those that depend least on stiffnesses; all if None.
        least: residual damping below which an equation is dropped [-].
        threads: side by side; the number of cores if not given.

    Returns:
        The identification.

    Raises:
        InputError: no mode that a stiffness moves by more than the threshold, and as `machine_sensitivity`,
            `solve_parts`, `select_stiffness` and `damping_least_squares`.
    """
    _check(references, positions, space, starts, threshold, rule, equations)
    clock = [time.perf_counter()]
    sensitivity = machine_sensitivity(machine, references, positions, space, seed=seed, n=n, threads=threads)
    clock.append(time.perf_counter())
    searched = sensitivity.searched(threshold)
    if not searched[:, unknowns(space).stiffness].any():
        raise InputError(f"No stiffness has a total effect above {threshold:g} on any mode. Lower the threshold.")
    runs = solve_parts(machine, references, positions, space, searched, seed=seed, starts=starts, threads=threads)
    clock.append(time.perf_counter())
    chosen = choose(machine, references, positions, runs, sensitivity, rule=rule, equations=equations, least=least)
    clock.append(time.perf_counter())
    steps = (after - before for before, after in itertools.pairwise(clock))
    return GuidedIdentification(sensitivity, runs, chosen, Seconds(*steps))


def choose(
    machine: Machine,
    references: Sequence[ReferenceModes],
    positions: Sequence[float],
    runs: PartRuns,
    sensitivity: MachineSensitivity,
    *,
    rule: str = PAPER,
    equations: int | None = 20,
    least: float = 0.005,
) -> ByRule:
    """Stiffnesses and dampings from runs already made.

    Args:
        machine: as `identify_by_parts`.
        references: as `identify_by_parts`.
        positions: as `identify_by_parts`.
        runs: of the small problems.
        sensitivity: Sobol study.
        rule: as `identify_by_parts`.
        equations: as `identify_by_parts`.
        least: as `identify_by_parts`.

    Returns:
        What the rule makes of the runs.

    Raises:
        InputError: as `select_stiffness` and `damping_least_squares`.
    """
    selection = select_stiffness(runs, rule)
    stiff = selection.machine(machine)
    rows = None if equations is None else least_disturbed(sensitivity, equations)
    damping = damping_least_squares(stiff, references, positions, runs.space, rows=rows, least=least)
    return ByRule(selection, damping, damping.machine(stiff))


def _check(
    references: Sequence[ReferenceModes],
    positions: Sequence[float],
    space: ParameterSpace,
    starts: int,
    threshold: float,
    rule: str,
    equations: int | None,
) -> None:
    """Refuse at once what would only be refused after minutes."""
    count = sum(one.omega.size for one in evidence(references, positions))
    require_threshold(threshold)
    require_rule(rule)
    require_starts(starts)
    if equations is not None and not 1 <= equations <= count:
        raise InputError(
            f"equations must be between 1 and the {count} reference modes, but is {equations}. None takes all modes."
        )
    kinds = unknowns(space)
    for name, numbers in (("stiffness", kinds.stiffness), ("damping", kinds.damping)):
        if numbers.size == 0:
            raise InputError(f"The space has no {name}. Add joints.<name>.<kind>.<direction>, see unknown_space.")
