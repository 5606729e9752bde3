"""How the time of a machine's study grows: with coordinates kept, parameters searched, starts, and base points."""

import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from fitting.identification.machine_affine import affine_machine
from fitting.identification.machine_evidence import evidence
from fitting.identification.machine_measurement import measured_modes
from fitting.identification.machine_parts import solve_parts
from fitting.identification.machine_sensitivity import SHAPE, MachineSensitivity, machine_sensitivity, mode_outputs
from fitting.identification.machine_study import IDENTIFICATION, random_truth
from fitting.identification.machine_unknowns import unknown_space, unknowns
from sensitivity import sobol_samples
from twin.modal import ReferenceModes
from twin.parameters import ParameterSpace
from twin.structure import Machine
from twin.structure.component import Component
from twin.structure.rail import Rail
from twin.structure.reference_machine import reference_machine


class Sizes(NamedTuple):
    """How large the runs are that growth is read from."""

    coordinates: tuple[int, ...] = (30, 45, 62)
    """Modes of the components kept: 30 are their rigid motions."""
    parameters: tuple[int, ...] = (3, 6, 9, 16)
    """Stiffnesses searched in every small problem."""
    starts: tuple[int, ...] = (25, 50, 100)
    """Starts of every small problem."""
    points: tuple[int, ...] = (64, 128, 256)
    """Base points N of the sensitivity study."""
    searched: int = 6
    """Stiffnesses searched where others grow."""
    runs: int = 16
    """Starts where others grow."""
    modes: int = 10
    """Reference modes, each with a small problem."""
    rounds: int = 2
    """Turns of timing; the shortest counts."""


class Growth(NamedTuple):
    """Time against one size."""

    name: str
    """What is timed, and against what."""
    sizes: tuple[int, ...]
    seconds: tuple[float, ...]
    """Time of one evaluation, of one solve, or of all [s]."""

    @property
    def exponent(self) -> float:
        """Slope of log time over log size."""
        return float(np.polyfit(np.log(self.sizes), np.log(self.seconds), 1)[0])


def all_growth(seed: int, sizes: Sizes | None = None) -> list[Growth]:
    """All tables of growth, on the reference machine against a random truth, at one position but for N.

    Args:
        seed: of the truth, samples and starts.
        sizes: how large the runs are.
    """
    sizes = Sizes() if sizes is None else sizes
    place = IDENTIFICATION[:1]
    modes, solves = [], []
    for count in sizes.coordinates:
        machine, references, space = _case(seed, count, place, sizes.modes)
        mask = most_effective(_study(machine, references, place, space, seed), sizes.searched)
        (one,) = evidence(references, place)
        part, samples = affine_machine(machine, space, place[0], one.outputs), sobol_samples(space, 16, seed=seed)
        rows = len(samples.distinct([space.paths[i] for i in part.stiffness]).values)

        def evaluate(part=part, one=one, samples=samples) -> None:
            mode_outputs([part], [one], samples)

        modes.append(shortest(evaluate, evaluate, sizes.rounds) / rows)
        solves.append(_per_solve(machine, references, space, mask, seed, sizes.runs, sizes.rounds))
    found = [
        Growth("modes of one sample, against coordinates kept", sizes.coordinates, tuple(modes)),
        Growth(f"solve with {sizes.searched} parameters, against coordinates kept", sizes.coordinates, tuple(solves)),
    ]

    machine, references, space = _case(seed, None, place, sizes.modes)
    study = _study(machine, references, place, space, seed)
    solves = [
        _per_solve(machine, references, space, most_effective(study, count), seed, sizes.runs, sizes.rounds)
        for count in sizes.parameters
    ]
    found.append(Growth("solve, against parameters searched", sizes.parameters, tuple(solves)))
    mask = most_effective(study, sizes.searched)
    together = [
        _per_solve(machine, references, space, mask, seed, starts, sizes.rounds) * starts * len(mask)
        for starts in sizes.starts
    ]
    found.append(Growth(f"all solves of {len(mask)} problems, against starts of each", sizes.starts, tuple(together)))

    machine, references, space = _case(seed, None, IDENTIFICATION, sizes.modes)
    studies = []
    for n in sizes.points:

        def study_of(n: int = n) -> None:
            machine_sensitivity(machine, references, IDENTIFICATION, space, seed=seed, n=n)

        studies.append(shortest(lambda: study_of(8), study_of, sizes.rounds))
    found.append(Growth("sensitivity study at three positions, against N", sizes.points, tuple(studies)))
    return found


def shortest(small: Callable[[], None], whole: Callable[[], None], rounds: int) -> float:
    """Shortest time of a call after a small one that compiles [s]."""
    small()
    times = []
    for _ in range(rounds):
        clock = time.perf_counter()
        whole()
        times.append(time.perf_counter() - clock)
    return min(times)


def most_effective(study: MachineSensitivity, count: int) -> np.ndarray:
    """Mask of the stiffnesses with the largest total effects on each reference mode's MACXP (problems, parameters)."""
    total = study.total(SHAPE).copy()
    total[:, unknowns(study.indices.space).damping] = -np.inf
    mask = np.zeros(total.shape, dtype=bool)
    np.put_along_axis(mask, np.argsort(-total, axis=1, kind="stable")[:, :count], True, axis=1)
    return mask


def with_fewer_modes(machine: Machine, count: int) -> Machine:
    """A machine whose components keep their lowest modes, as many in all.

    Args:
        machine: the machine.
        count: modes kept, at least the rigid ones.
    """
    values = {name: np.asarray(component.eigenvalues) for name, component in machine.components.items()}
    limit = np.sort(np.concatenate(list(values.values())))[count - 1]
    kept = {name: int(np.sum(own <= limit)) for name, own in values.items()}
    components = {name: _first(component, kept[name]) for name, component in machine.components.items()}
    return Machine(components, machine.joints, machine.masses)


def _first(component: Component, count: int) -> Component:
    return Component(
        component.eigenvalues[:count],
        component.shapes[..., :count],
        component.positions,
        component.nodes,
        loss_factor=component.loss_factor,
        rails={name: Rail(rail.coordinate, rail.shapes[..., :count]) for name, rail in component.rails.items()},
    )


def _case(
    seed: int, coordinates: int | None, positions: Sequence[float], modes: int
) -> tuple[Machine, tuple[ReferenceModes, ...], ParameterSpace]:
    machine = reference_machine() if coordinates is None else with_fewer_modes(reference_machine(), coordinates)
    space = unknown_space(machine)
    truth = space.with_values(machine, space.values(random_truth(seed)))
    return machine, measured_modes(truth, positions, count=modes), space


def _study(
    machine: Machine,
    references: Sequence[ReferenceModes],
    positions: Sequence[float],
    space: ParameterSpace,
    seed: int,
) -> MachineSensitivity:
    return machine_sensitivity(machine, references, positions, space, seed=seed, n=16)


def _per_solve(
    machine: Machine,
    references: Sequence[ReferenceModes],
    space: ParameterSpace,
    mask: np.ndarray,
    seed: int,
    starts: int,
    rounds: int,
) -> float:
    def solves(runs: int = starts) -> None:
        solve_parts(machine, references, IDENTIFICATION[:1], space, mask, seed=seed, starts=runs)

    return shortest(lambda: solves(2), solves, rounds) / (starts * len(mask))


def as_markdown(rows: list[Growth]) -> str:
    """Table of the growth."""
    lines = [
        "### How time grows",
        "",
        "| time of | sizes | milliseconds | exponent |",
        "|---|---|---|---|",
    ]
    for row in rows:
        sizes, times = (", ".join(parts) for parts in (map(str, row.sizes), (f"{1e3 * t:.3g}" for t in row.seconds)))
        lines.append(f"| {row.name} | {sizes} | {times} | {row.exponent:.2f} |")
    return "\n".join(lines) + "\n"


def as_dictionary(rows: list[Growth]) -> list[dict]:
    """The rows for `benchmarks.json`."""
    return [{**row._asdict(), "exponent": row.exponent} for row in rows]
