"""Stiffnesses and dampings of a machine from its measured modes, with their uncertainty."""

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from fitting.fit import fit
from fitting.identifiability import IdentifiabilityReport, identifiability
from fitting.identification.force_balance import ForceBalance, force_balance
from fitting.identification.machine_data import evidence, nuisance_space, stiffness_space
from fitting.residuals.modes import ModesResidual
from fitting.residuals.prior import GaussianPrior
from fitting.residuals.residual import JointResidual
from fitting.result import FitResult
from twin._checks import above_zero
from twin.modal import ReferenceModes
from twin.parameters import ParameterSpace
from twin.structure import Machine
from twin.structure.reference_quantities import Quantity

# Least likeness of a pair of modes that is believed: by MACXP with 20 % of damping, nearly the MAC.
_LIKE = 0.5
_ROUNDS = 3


class UnpairedMode(NamedTuple):
    """A measured mode that no mode of the fitted machine is like; it was left out of the fit."""

    position: float
    """Axis position [m]."""
    mode: int
    """Number of the mode there, from 0."""
    frequency: float
    """Its frequency [Hz]."""
    likeness: float
    """MACXP, with wide damping, of the mode most like it that was left over [-]."""


class MachineIdentification(NamedTuple):
    """A machine identified from its modes."""

    machine: Machine
    """The machine with the identified parameters."""
    start: ForceBalance
    """Stiffnesses by balance of forces, from which the joint fit started."""
    fit: FitResult
    """Joint fit of all parameters to frequencies, shapes and damping ratios."""
    unpaired: tuple[UnpairedMode, ...]
    """Measured modes that could not be paired."""

    @property
    def seen(self) -> IdentifiabilityReport:
        """Which parameters the modes determine."""
        return identifiability(self.fit)


def identify_machine(
    machine: Machine,
    references: Sequence[ReferenceModes],
    positions: Sequence[float],
    space: ParameterSpace,
    *,
    uncertain: Sequence[Quantity] = (),
    uncertainty: float = 0.03,
    residual: ModesResidual | None = None,
    start: Machine | None = None,
    max_steps: int = 60,
) -> MachineIdentification:
    """Identify the parameters of a machine's joints from modes measured at several axis positions.

    Stiffnesses by balance of forces first, which needs neither a good start nor pairs of modes; then all parameters
    together on frequencies, shapes and damping ratios, by Levenberg-Marquardt. Quantities that are not searched but
    known to some per cent only may be let go within what is believed of them (maximum a posteriori): what is wrong with
    them does then not end up in the stiffnesses.

    Measured modes that no mode is like are left out, tried again once the others are fitted, and reported.

    Args:
        machine: model with nominal values, and what is believed of the uncertain quantities.
        references: measured modes at each position; one that was not found is left out or NaN.
        positions: axis positions [m].
        space: the searched parameters, stiffnesses and dampings of joints, on a logarithmic scale with bounds.
        uncertain: quantities let go.
        uncertainty: standard deviation of what is believed of them, as a share of their value [-].
        residual: evidence with weights of its own; with those of `ModesResidual.of` if not given.
        start: where the joint fit starts; the balance of forces if not given.
        max_steps: steps of a fit.

    Returns:
        The identified machine. Standard errors hold for weights that are exact.

    Raises:
        InputError: a position off a rail, an output that the machine does not have, a parameter that is no stiffness
            of a joint where one must be, whatever `fit` refuses.
    """
    above_zero("uncertainty", uncertainty, "-")
    data = evidence(machine, references, positions) if residual is None else residual
    balanced = force_balance(machine, references, positions, stiffness_space(space))
    model = balanced.machine if start is None else start
    searched, prior = space, ()
    if uncertain:
        others = nuisance_space(uncertain)
        believed = np.asarray(others.values(machine))
        searched = ParameterSpace([*space.parameters, *others.parameters])
        prior = (GaussianPrior(believed, uncertainty * np.abs(believed), others.paths),)

    def fitted(model: Machine, data: ModesResidual) -> FitResult:
        everything = JointResidual((data, *prior), ("modes", "belief")[: 1 + len(prior)])
        return fit(everything, model, searched, max_steps=max_steps, variance="known")

    weight, measured = _believed(data, model, np.asarray(data.weight)), np.asarray(data.weight)
    result = fitted(model, _weighted(data, weight))
    for _ in range(_ROUNDS):
        again = _believed(data, result.model, measured)
        if np.array_equal(again, weight):
            break
        weight = again
        result = fitted(result.model, _weighted(data, weight))
    return MachineIdentification(result.model, balanced, result, _unpaired(data, result.model, measured, weight))


def _believed(data: ModesResidual, model: Machine, measured: np.ndarray) -> np.ndarray:
    """Weights of the measured modes: 1 for those that a mode of the model is like."""
    return np.where(np.asarray(_pairs(data, model)) >= _LIKE, measured, 0.0)


def _weighted(data: ModesResidual, weight: np.ndarray) -> ModesResidual:
    return eqx.tree_at(lambda d: d.weight, data, jnp.asarray(weight))


@eqx.filter_jit
def _pairs(data: ModesResidual, model: Machine) -> jnp.ndarray:
    return data.pairs(model).value


def _unpaired(
    data: ModesResidual, model: Machine, measured: np.ndarray, weight: np.ndarray
) -> tuple[UnpairedMode, ...]:
    likeness = np.asarray(_pairs(data, model))
    return tuple(
        UnpairedMode(float(data.position[i]), int(j), float(data.frequency[i, j]), float(likeness[i, j]))
        for i, j in np.argwhere((measured > 0) & (weight == 0))
    )
