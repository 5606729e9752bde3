"""Stiffnesses and dampings of a machine from its measured modes, with their uncertainty."""

import warnings
from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array
from threadpoolctl import threadpool_limits

from fitting.fit import fit
from fitting.identifiability import IdentifiabilityReport, identifiability
from fitting.identification.force_balance import ForceBalance, force_balance
from fitting.identification.machine_measurement import modal_evidence
from fitting.identification.machine_unknowns import nuisance_space, stiffness_space
from fitting.residuals.modes import ModesResidual
from fitting.residuals.prior import GaussianPrior
from fitting.residuals.residual import JointResidual
from fitting.result import FitResult
from twin._checks import InputError, above_zero
from twin.modal import ReferenceModes
from twin.parameters import ParameterSpace
from twin.structure import Machine
from twin.structure.reference_quantities import Quantity

# Least likeness of a pair of modes that is believed: by MACXP with 20 % of damping, nearly the MAC.
_LIKE = 0.5
_ROUNDS = 3
# Share of the measured modes that must be paired for the result to be believed.
_ENOUGH = 0.5
_UNLIKE = "The machine is too unlike the measurement: are frequencies in Hz, positions in m, rows named by its nodes?"


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
    start: ForceBalance | None
    """Stiffnesses by balance of forces, from which the joint fit started; None if it was given another start."""
    fit: FitResult
    """Joint fit of all parameters to frequencies, shapes and damping ratios."""
    unpaired: tuple[UnpairedMode, ...]
    """Measured modes that could not be paired."""
    evidence: ModesResidual
    """The measured modes with the weights that they had in the joint fit; zero for those not paired."""

    @property
    def success(self) -> bool:
        """Whether the fit converged, and on at least half of the measured modes."""
        return self.fit.success and self._alike

    @property
    def message(self) -> str:
        """How many modes were paired, and why the fit ended."""
        found = f"{self._paired} of {self._measured} measured modes are paired with modes of the machine."
        if not self._alike:
            found += f" {_UNLIKE}"
        return f"{found} {self.fit.message}"

    @property
    def _alike(self) -> bool:
        return self._paired >= _ENOUGH * self._measured

    @property
    def _paired(self) -> int:
        return int(np.count_nonzero(np.asarray(self.evidence.weight) > 0))

    @property
    def _measured(self) -> int:
        return self._paired + len(self.unpaired)

    def __repr__(self) -> str:
        return f"{self.fit!r}\n{self.message}"

    def _repr_html_(self) -> str:
        return f"{self.fit._repr_html_()}<p>{self.message}</p>"

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
        InputError: a position off a rail or twice, an output that the machine does not have, a parameter that is no
            stiffness of a joint where one must be, no measured mode that a mode of the machine is like, whatever `fit`
            refuses.

    Warns:
        UserWarning: more than half of the measured modes could not be paired.
    """
    above_zero("uncertainty", uncertainty, "-")
    data = modal_evidence(machine, references, positions) if residual is None else residual
    if start is None:
        balanced = force_balance(machine, references, positions, stiffness_space(space))
        model = balanced.machine
    else:
        balanced, model = None, start
    searched, prior = space, ()
    if uncertain:
        others = nuisance_space(uncertain)
        believed = np.asarray(others.values(machine))
        searched = ParameterSpace([*space.parameters, *others.parameters])
        prior = (GaussianPrior(believed, uncertainty * np.abs(believed), others.paths),)

    def fitted(model: Machine, weight: np.ndarray) -> tuple[FitResult, np.ndarray]:
        weighted = eqx.tree_at(lambda d: d.weight, data, jnp.asarray(weight))
        everything = JointResidual((weighted, *prior), ("modes", "belief")[: 1 + len(prior)])
        with threadpool_limits(1, user_api="blas"):  # busy cores make small factorisations wait for each other
            result = fit(everything, model, searched, max_steps=max_steps, variance="known")
        return result, np.asarray(_likeness(data, result.model))

    measured = np.asarray(data.weight)
    weight = _believed(np.asarray(_likeness(data, model)), measured)
    if not weight.any():
        raise InputError(f"No mode of the machine is like any of the {np.count_nonzero(measured)} measured. {_UNLIKE}")
    result, likeness = fitted(model, weight)
    for _ in range(_ROUNDS):
        again = _believed(likeness, measured)
        if np.array_equal(again, weight):
            break
        weight = again
        result, likeness = fitted(result.model, weight)
    unpaired = tuple(
        UnpairedMode(float(data.position[i]), int(j), float(data.frequency[i, j]), float(likeness[i, j]))
        for i, j in np.argwhere((measured > 0) & (weight == 0))
    )
    used = eqx.tree_at(lambda d: d.weight, data, jnp.asarray(weight))
    found = MachineIdentification(result.model, balanced, result, unpaired, used)
    if not found._alike:
        warnings.warn(found.message, stacklevel=2)
    return found


def _believed(likeness: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Weights of the measured modes: 1 for those that a mode of the model is like."""
    return np.where(likeness >= _LIKE, measured, 0.0)


@eqx.filter_jit
def _likeness(data: ModesResidual, model: Machine) -> Array:
    return data.pairs(model).value
