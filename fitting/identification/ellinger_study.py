"""The two cases of Ellinger and Zaeh on the reference machine: an ideal model, and a disturbed one.

In both the reference data are those of a random truth. The published procedure comes first; a joint fit of all
parameters starts from what it finds.

Source: sections 3.2 and 3.3 of J. Ellinger, M. F. Zaeh, Machines 10 (2022) 535.
"""

import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from fitting.identification.conformity import ConformityStatistics
from fitting.identification.machine import MachineIdentification, identify_machine
from fitting.identification.machine_measurement import measured_modes
from fitting.identification.machine_procedure import ByRule, GuidedIdentification, choose, identify_by_parts
from fitting.identification.machine_screening import MachineScreening, screen_machine
from fitting.identification.machine_selection import ROBUST
from fitting.identification.machine_study import (
    DISTURBED,
    IDENTIFICATION,
    VALIDATION,
    Deviation,
    conformity_of,
    disturbed_machine,
    identify_truth,
    permuted_damping,
    random_truth,
)
from fitting.identification.machine_unknowns import unknown_space
from twin.modal import ReferenceModes
from twin.structure import Machine
from twin.structure.reference_machine import reference_machine
from twin.structure.reference_quantities import UNKNOWN, Quantity

IDEAL, DISTURBED_MODEL = "ideal", "disturbed"
"""Names of the cases."""


class Tables(NamedTuple):
    """Conformity of a model with the truth."""

    identification: ConformityStatistics
    """Over positions z2 to z4, tables 2 and 4."""
    validation: ConformityStatistics
    """At position z1, which is held back, tables 3 and 5."""


class Case(NamedTuple):
    """One truth, identified as published and then jointly."""

    name: str
    """"ideal" or "disturbed"."""
    seed: int
    """Of the truth."""
    truth: Machine
    """The machine that the reference data are of."""
    model: Machine
    """The machine that is identified."""
    references: tuple[ReferenceModes, ...]
    """Modes of the truth at z2 to z4."""
    screening: MachineScreening
    """Bounds on the total effects, before the procedure."""
    screening_seconds: float
    """Time of the screening, with compilation where the process had not compiled it before [s]."""
    guided: GuidedIdentification
    """The procedure as published."""
    robust: ByRule
    """What the robust rule makes of the same runs, with the damping ratios of all modes."""
    refined: MachineIdentification
    """The joint fit, started from the robust rule's machine."""
    refinement_seconds: float
    """Time of the joint fit, with compilation where the process had not compiled it before [s]."""

    @property
    def machines(self) -> dict[str, Machine]:
        """The identified machines: "published", "robust", "refined"."""
        return {
            "published": self.guided.machine,
            "robust": self.robust.machine,
            "refined": self.refined.machine,
        }

    def permuted(self) -> Machine:
        """The control of figs. 7 and 9: the published procedure's machine, deviations of the dampings dealt anew."""
        return permuted_damping(self.guided.machine, self.truth)

    def tables(self, machine: Machine) -> Tables:
        """Tables 2 and 3, or 4 and 5.

        Args:
            machine: an identified machine.
        """
        return Tables(*(conformity_of(machine, self.truth, z) for z in (IDENTIFICATION, VALIDATION)))


def study_case(
    seed: int,
    *,
    disturbed: bool = False,
    uncertain: Sequence[Quantity] = DISTURBED,
    n: int = 1024,
    starts: int = 100,
) -> Case:
    """Identify one random truth as published, by the robust rule, and by a joint fit.

    Args:
        seed: of the truth and the disturbance; samples and starts take the next one.
        disturbed: whether other quantities of the model are wrong.
        uncertain: what the joint fit lets go if so.
        n: base points of the sensitivity study.
        starts: runs of each small problem.
    """
    truth = random_truth(seed)
    model = disturbed_machine(seed) if disturbed else reference_machine()
    references = measured_modes(truth, IDENTIFICATION)
    nominal = reference_machine()
    space = unknown_space(nominal)
    clock = time.perf_counter()
    screening = screen_machine(model, references, IDENTIFICATION, space, seed=seed + 1)
    screening_seconds = time.perf_counter() - clock
    guided = identify_by_parts(model, references, IDENTIFICATION, space, seed=seed + 1, n=n, starts=starts)
    # With stiffnesses that are right, more equations mean better dampings.
    robust = choose(
        model, references, IDENTIFICATION, guided.runs, guided.sensitivity, rule=ROBUST, equations=None, least=0.0
    )
    clock = time.perf_counter()
    refined = identify_machine(
        model,
        references,
        IDENTIFICATION,
        unknown_space(nominal, scale="log"),
        uncertain=uncertain if disturbed else (),
        start=robust.machine,
    )
    refinement_seconds = time.perf_counter() - clock
    name = DISTURBED_MODEL if disturbed else IDEAL
    return Case(
        name,
        seed,
        truth,
        model,
        references,
        screening,
        screening_seconds,
        guided,
        robust,
        refined,
        refinement_seconds,
    )


def deviations(machine: Machine, truth: Machine) -> dict[str, float]:
    """How far the 27 parameters are from the true ones, by name [%].

    Args:
        machine: identified machine.
        truth: the machine that it was identified from.
    """
    space = unknown_space(reference_machine())
    shares = np.asarray(space.values(machine)) / np.asarray(space.values(truth)) - 1
    return dict(zip((q.name for q in UNKNOWN), (100 * shares).tolist(), strict=True))


class Repeat(NamedTuple):
    """One of many truths, identified by balance of forces and joint fit."""

    seed: int
    """Of the truth and of the disturbance."""
    deviation: Deviation
    """How far the parameters are from the true ones."""
    validation: ConformityStatistics
    """Conformity at the position held back."""


def repeat_ideal(seeds: Sequence[int]) -> tuple[Repeat, ...]:
    """Identify random truths from exact modes with a model that can repeat them.

    Args:
        seeds: of the truths.
    """
    return _repeated(identify_truth, seeds)


def repeat_disturbed(seeds: Sequence[int], uncertain: Sequence[Quantity] = DISTURBED) -> tuple[Repeat, ...]:
    """Identify random truths with disturbed models, whose uncertain quantities are let go within what is believed.

    Args:
        seeds: of the truths and disturbances.
        uncertain: what is let go.
    """
    return _repeated(lambda seed: identify_truth(seed, model=disturbed_machine(seed), uncertain=uncertain), seeds)


def _repeated(identify: Callable[[int], Deviation], seeds: Sequence[int]) -> tuple[Repeat, ...]:
    def one(seed: int) -> Repeat:
        found = identify(seed)
        return Repeat(seed, found, conformity_of(found.identification.machine, random_truth(seed), VALIDATION))

    # One after the other: JAX's own programs wait for each other for ever when two threads call LAPACK in them.
    return tuple(one(seed) for seed in seeds)
