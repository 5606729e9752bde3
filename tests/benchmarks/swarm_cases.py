"""Problems of the swarm ledger, and the one that Ellinger and Zaeh solve 6,000 times."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.identification.machine_affine import affine_machine
from fitting.identification.machine_evidence import evidence
from fitting.identification.machine_likeness import PartData, Shares, Unlikeness
from fitting.identification.machine_measurement import measured_modes
from fitting.identification.machine_part_data import PartProblem, data_from_start
from fitting.identification.machine_sensitivity import machine_sensitivity
from fitting.identification.machine_study import IDENTIFICATION, random_truth
from fitting.identification.machine_unknowns import unknown_space
from fitting.residuals.residual import AbstractResidual
from tests.benchmarks.machine_growth import most_effective
from twin.parameters import Parameter, ParameterSpace
from twin.structure.reference_machine import reference_machine

SMALL = 5
"""Stiffnesses of the small problem of the machine."""


class SwarmProblem(NamedTuple):
    """What the methods of the ledger are given."""

    residual: AbstractResidual
    model: Any
    space: ParameterSpace
    slack: float = 0.0
    """Cost above the best that counts as the same error, beside a share of it."""
    starts: int = 8
    """Of the gradient methods, all of which are paid for."""
    max_steps: int = 300
    """Of a gradient method from one start."""
    iterations: int = 400
    """Of the swarm, at most."""


class Repeated(AbstractResidual):
    """A residual with fewer rows than parameters, which a fit would refuse, repeated; its cost stays."""

    residual: AbstractResidual
    """The residual."""
    times: int = eqx.field(static=True)
    """How often."""

    def __call__(self, model: Any) -> Float[Array, "residuals"]:
        return jnp.tile(self.residual(model) / jnp.sqrt(1.0 * self.times), self.times)


def ellinger_small_problem(seed: int = 1, mode: int = 7) -> SwarmProblem:
    """1 - MACXP of one mode over the five stiffnesses that turn it most, the others being right: its least is zero.

    Args:
        seed: of the truth.
        mode: number of the reference mode.
    """
    truth, nominal = random_truth(seed), reference_machine()
    space, place = unknown_space(nominal), IDENTIFICATION[:1]
    references = measured_modes(truth, place)
    (one,) = evidence(references, place)
    part = affine_machine(nominal, space, place[0], one.outputs)
    study = machine_sensitivity(nominal, references, place, space, seed=seed, n=16)
    mask = most_effective(study, SMALL)[mode][part.stiffness]
    bounds = np.asarray([(p.lower, p.upper) for p in space.parameters])[part.stiffness]
    values = np.asarray(space.values(truth))[part.stiffness]
    rows = int(mask[part.spring_of].sum())
    problem = PartProblem(part, one, mode, mask, bounds, rows, SMALL)
    leaves = data_from_start(problem, values[None])
    free = ParameterSpace([Parameter(f"share.{i}", "", 0.0, 1.0, size=1.0) for i in range(SMALL)])
    residual = Repeated(Unlikeness(PartData(*(jnp.asarray(leaf[0]) for leaf in leaves))), SMALL)
    return SwarmProblem(residual, Shares(jnp.full(SMALL, 0.5)), free, slack=1e-6)
