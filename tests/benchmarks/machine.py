"""The whole study of a machine, and what NumPy, SciPy and SALib take for its two long steps in the same run.

120 analyses over 27 parameters, 6,000 bounded solves, selection and damping, joint fit: `study_case` step by step, each
step after a call that compiles. The peers run a sample of the work, on as many cores, and are scaled to the whole.
"""

import itertools
import os
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from fitting.identification.machine import identify_machine
from fitting.identification.machine_affine import affine_machine
from fitting.identification.machine_evidence import evidence
from fitting.identification.machine_measurement import measured_modes
from fitting.identification.machine_part_runs import PartRuns
from fitting.identification.machine_parts import solve_parts
from fitting.identification.machine_procedure import choose
from fitting.identification.machine_selection import ROBUST
from fitting.identification.machine_sensitivity import MachineSensitivity, machine_sensitivity, mode_outputs
from fitting.identification.machine_study import IDENTIFICATION, random_truth
from fitting.identification.machine_unknowns import unknown_space
from sensitivity import sobol_samples
from tests.benchmarks import machine_growth, machine_peers
from tests.benchmarks.machine_growth import Growth, Sizes
from tests.benchmarks.machine_peers import Place, Solve
from twin.modal import ReferenceModes
from twin.parameters import ParameterSpace
from twin.structure.reference_machine import MODES, reference_machine

SENSITIVITY, SOLVES, DAMPING, REFINEMENT = "sensitivity", "bounded solves", "selection and damping", "joint fit"
"""The steps."""
AS_GOOD = 1e-6
"""Difference of 1 - MACXP up to which two ends are as good as each other."""


class Problem(NamedTuple):
    """What is identified."""

    references: tuple[ReferenceModes, ...]
    positions: tuple[float, ...]
    space: ParameterSpace
    truth: np.ndarray
    """True values of the parameters, SI."""


class Study(NamedTuple):
    """The whole study, run once."""

    problem: Problem
    seconds: dict[str, float]
    """Time of each step, compiled before [s]."""
    first: dict[str, float]
    """Time of the small call, or the first one, that compiled each step [s]."""
    n: int
    """Base points."""
    sensitivity: MachineSensitivity
    runs: PartRuns
    deviation: float
    """Largest relative deviation of the joint fit from the truth [-]."""
    load: float
    """Processes that wanted a core as it began, the mean of a minute."""

    @property
    def total(self) -> float:
        """Time of all steps [s]."""
        return sum(self.seconds.values())


class Peers(NamedTuple):
    """What the peers took for a part of the work, and what of it they found."""

    processes: int
    samples: int
    """Samples solved at all positions."""
    sampling_seconds: float
    """SALib's samples of the whole study [s]."""
    sample_seconds: float
    """Time per sample, over all processes [s]."""
    analysis_seconds: float
    """SALib's time per output at the whole study's N, over all processes [s]."""
    solves: int
    solve_seconds: float
    """Time per solve, over all processes [s]."""
    eigenproblems: float
    """Eigenproblems per solve."""
    difference: float
    """Largest difference of MACXP between their samples and ours [-]."""
    as_good: float
    """Share of their solves that end as well as ours from the same start."""
    ours_as_good: float
    """Share of ours that end as well as theirs."""

    def scaled(self, study: Study) -> dict[str, float]:
        """Their time for the whole study, step by step [s].

        Args:
            study: ours.
        """
        rows = study.n * (len(study.problem.space) + 2)
        analyses = 2 * len(study.runs.problems)
        return {
            SENSITIVITY: self.sampling_seconds + rows * self.sample_seconds + analyses * self.analysis_seconds,
            SOLVES: study.runs.macxp.size * self.solve_seconds,
        }


class MachineBenchmark(NamedTuple):
    """The section's results."""

    study: Study
    peers: Peers
    growth: list[Growth]


def problem_of(seed: int, positions: tuple[float, ...] = IDENTIFICATION, modes: int = MODES) -> Problem:
    """A random truth to be identified by the nominal reference machine.

    Args:
        seed: of the truth.
        positions: axis positions [m].
        modes: reference modes at each.
    """
    truth, space = random_truth(seed), unknown_space(reference_machine())
    references = measured_modes(truth, positions, count=modes)
    return Problem(references, tuple(positions), space, np.asarray(space.values(truth)))


def whole_study(problem: Problem, *, seed: int, n: int = 1024, starts: int = 100) -> Study:
    """Run the study as `study_case` does, and time its steps.

    Args:
        problem: what is identified.
        seed: of samples and starts.
        n: base points of the sensitivity study.
        starts: runs of each small problem.
    """
    machine, (references, positions, space, truth) = reference_machine(), problem
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    seconds, first = {}, {}

    def timed(step: str, small: Callable[[], Any], whole: Callable[[], Any]) -> Any:
        clock = [time.perf_counter()]
        for call in (small, whole):
            found = call()
            clock.append(time.perf_counter())
        first[step], seconds[step] = (after - before for before, after in itertools.pairwise(clock))
        return found

    def study(points: int) -> MachineSensitivity:
        return machine_sensitivity(machine, references, positions, space, seed=seed, n=points)

    def solved(runs: int) -> PartRuns:
        searched = sensitivity.searched()
        return solve_parts(machine, references, positions, space, searched, seed=seed, starts=runs)

    def chosen() -> Any:
        equations = min(20, len(sensitivity.problems))
        choose(machine, references, positions, runs, sensitivity, equations=equations)
        return choose(machine, references, positions, runs, sensitivity, rule=ROBUST, equations=None, least=0.0)

    def refined() -> Any:
        logarithmic = unknown_space(machine, scale="log")
        return identify_machine(machine, references, positions, logarithmic, start=robust.machine)

    sensitivity = timed(SENSITIVITY, lambda: study(8), lambda: study(n))
    # Two starts of every problem meet all programs, as sets of lanes have one width.
    runs = timed(SOLVES, lambda: solved(2), lambda: solved(starts))
    robust = timed(DAMPING, chosen, chosen)
    end = timed(REFINEMENT, refined, refined)
    deviation = float(np.max(np.abs(np.asarray(space.values(end.machine)) / truth - 1)))
    return Study(problem, seconds, first, n, sensitivity, runs, deviation, load)


def peers_of(study: Study, *, seed: int, points: int = 8, starts: int = 1, analyses: int = 4) -> Peers:
    """Let the peers do a part of a study's work.

    Args:
        study: ours.
        seed: of the samples.
        points: base points whose samples they solve, at all positions: 29 samples each.
        starts: starts of every small problem that they run, the first of ours.
        analyses: outputs that SALib analyses.
    """
    references, positions, space, _ = study.problem
    data = evidence(references, positions)
    parts = [affine_machine(reference_machine(), space, one.position, one.outputs) for one in data]
    places = [_place(part, one) for part, one in zip(parts, data, strict=True)]
    bounds = np.asarray([(p.lower, p.upper) for p in space.parameters])
    samples = sobol_samples(space, points, seed=seed)
    numbers = [(place, mode) for place, one in zip(places, data, strict=True) for mode in range(one.omega.size)]
    runs = study.runs
    tasks = [
        Solve(*numbers[i], np.flatnonzero(mask), runs.start[i, j], *bounds[runs.stiffness][mask].T)
        for i, mask in enumerate(runs.searched)
        for j in range(starts)
        if mask.any()
    ]
    ends = np.concatenate([1 - runs.macxp[i, :starts] for i, mask in enumerate(runs.searched) if mask.any()])

    clock = time.perf_counter()
    drawn = machine_peers.salib_samples(space.paths, bounds, study.n, seed)
    sampling = time.perf_counter() - clock
    ours, _, _ = mode_outputs(parts, data, samples)
    outputs = np.random.default_rng(seed).random((len(drawn), analyses))
    with machine_peers.processes(places) as pool:
        clock = [time.perf_counter()]
        shape, _ = machine_peers.run_samples(pool, samples.values)
        clock.append(time.perf_counter())
        machine_peers.run_analyses(pool, space.paths, bounds, outputs)
        clock.append(time.perf_counter())
        found = np.asarray(machine_peers.run_solves(pool, tasks))
        clock.append(time.perf_counter())
    sampled, analysed, solved = (after - before for before, after in itertools.pairwise(clock))
    cost = found[:, 0]
    return Peers(
        processes=os.cpu_count() or 1,
        samples=len(samples),
        sampling_seconds=sampling,
        sample_seconds=sampled / len(samples),
        analysis_seconds=analysed / analyses,
        solves=len(tasks),
        solve_seconds=solved / len(tasks),
        eigenproblems=float(found[:, 1].mean()),
        difference=float(np.max(np.abs(shape - ours))),
        as_good=float(np.mean(cost <= ends + AS_GOOD)),
        ours_as_good=float(np.mean(ends <= cost + AS_GOOD)),
    )


def _place(part: Any, one: Any) -> Place:
    """What the peers are given of a position, by the names of its fields."""
    return Place(*(getattr(part if hasattr(part, name) else one, name) for name in Place._fields))


def machine_benchmark(
    seed: int = 1, *, n: int = 1024, starts: int = 100, peer_starts: int = 2, sizes: Sizes | None = None
) -> MachineBenchmark:
    """The whole section.

    Args:
        seed: of truth, samples and starts.
        n: base points of the sensitivity study.
        starts: runs of each small problem.
        peer_starts: starts of each small problem that the peers run.
        sizes: how large the runs are that growth is read from.
    """
    study = whole_study(problem_of(seed), seed=seed + 1, n=n, starts=starts)
    peers = peers_of(study, seed=seed + 1, starts=peer_starts)
    return MachineBenchmark(study, peers, machine_growth.all_growth(seed, sizes))
