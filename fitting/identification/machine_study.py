"""The reference machine identified again and again: from exact modes, from noisy ones, and with a disturbed model."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from fitting.identifiability import IDENTIFIED
from fitting.identification.conformity import ConformityStatistics, conformity
from fitting.identification.machine import MachineIdentification, identify_machine
from fitting.identification.machine_measurement import measured_modes, noisy, translations
from fitting.identification.machine_unknowns import nuisance_space, unknown_space
from twin.frf import FRF
from twin.linear import frequency_response
from twin.parameters import ParameterSpace
from twin.structure import Machine
from twin.structure.reference_machine import POSITIONS, reference_machine
from twin.structure.reference_quantities import DISTURBABLE, UNKNOWN, Quantity

if TYPE_CHECKING:
    import pandas as pd

IDENTIFICATION = POSITIONS[1:]
"""Positions z2 to z4, from which the machine is identified [m]; section 3.2."""
VALIDATION = POSITIONS[:1]
"""Position z1, held back [m]."""
DISTURBED = DISTURBABLE[:44]
"""The 44 quantities that are disturbed: those to which the modes are least sensitive, by `evidence_sensitivity`;
section 3.3."""
# Excitation at the workpiece table, and frequencies of the responses: those of fig. 7.
_EXCITATION = ("N6 x", "N6 y", "N6 z")
_FREQUENCIES = np.arange(5.0, 501.0, 1.0)


class Deviation(NamedTuple):
    """How far identified parameters are from the true ones."""

    truth: np.ndarray
    """True values in the order of `UNKNOWN`, SI."""
    found: np.ndarray
    """Identified values."""
    identification: MachineIdentification
    """The identification."""

    @property
    def relative(self) -> np.ndarray:
        """found / truth - 1 [-]."""
        return self.found / self.truth - 1

    @property
    def stiffness(self) -> np.ndarray:
        """Of the 16 stiffnesses [-]."""
        return self.relative[_IS_STIFFNESS]

    @property
    def damping(self) -> np.ndarray:
        """Of the 11 dampings [-]."""
        return self.relative[~_IS_STIFFNESS]


_IS_STIFFNESS = np.array([quantity.kind == "stiffness" for quantity in UNKNOWN])


def random_truth(seed: int, *, stiffness: float = 0.2, damping: float = 2.0) -> Machine:
    """A machine whose parameters lie off the middle of the bounds.

    Args:
        seed: of the random numbers.
        stiffness: largest deviation of a stiffness from its nominal value, as a share [-].
        damping: largest factor between a damping and its nominal value, either way [-].
    """
    return _truth(reference_machine(), seed, stiffness, damping)


def _truth(machine: Machine, seed: int, stiffness: float = 0.2, damping: float = 2.0) -> Machine:
    """`random_truth` around a machine that is at hand: to build one takes a tenth of a second."""
    space, random = _space(machine), np.random.default_rng(seed)
    number = len(UNKNOWN)
    shares = np.where(
        _IS_STIFFNESS,
        random.uniform(1 - stiffness, 1 + stiffness, number),
        damping ** random.uniform(-1, 1, number),
    )
    return space.with_values(machine, space.values(machine) * jnp.asarray(shares))


def disturbed_machine(
    seed: int, quantities: Sequence[Quantity] = DISTURBED, *, least: float = 0.01, most: float = 0.05
) -> Machine:
    """The nominal machine with other quantities changed at random, up or down.

    Args:
        seed: of the random numbers.
        quantities: what is changed.
        least: least change, as a share [-].
        most: largest change [-].
    """
    machine, space = reference_machine(), nuisance_space(quantities)
    random = np.random.default_rng(seed)
    shares = 1 + random.choice([-1.0, 1.0], len(quantities)) * random.uniform(least, most, len(quantities))
    return space.with_values(machine, space.values(machine) * jnp.asarray(shares))


def identify_truth(
    seed: int, *, model: Machine | None = None, uncertain: Sequence[Quantity] = (), noise: int | None = None
) -> Deviation:
    """Identify a random truth from its modes at z2 to z4.

    Args:
        seed: of the truth.
        model: model that is identified; the nominal machine, which can repeat the truth, if not given.
        uncertain: quantities of the model that are let go, see `identify_machine`.
        noise: seed of the measurement noise; none if not given.
    """
    nominal = reference_machine()
    model = nominal if model is None else model
    space, truth = _space(nominal), _truth(nominal, seed)
    references = measured_modes(truth, IDENTIFICATION)
    references = references if noise is None else noisy(references, noise)
    found = identify_machine(model, references, IDENTIFICATION, space, uncertain=uncertain)
    return Deviation(np.asarray(space.values(truth)), np.asarray(space.values(found.machine)), found)


class Coverage(NamedTuple):
    """How often intervals of 95 % hold the truth."""

    parameters: tuple[str, ...]
    """Paths of the parameters."""
    share: np.ndarray
    """Share of the repeats in which they do, of those that identify the parameter; NaN where none does [-]."""
    identified: np.ndarray
    """Share of the repeats in which each parameter is reported as identified [-]."""
    error: np.ndarray
    """Median standard error, as a share of the value, by parameter [-]."""
    repeats: int
    """Number of repeats."""
    failures: int
    """Fits that did not converge or left out a mode; they count nowhere else."""

    @property
    def pooled(self) -> float:
        """Share over all parameters together [-]."""
        return float(np.nansum(self.share * self.identified) / np.sum(self.identified))

    def to_dataframe(self) -> "pd.DataFrame":
        """One row per parameter."""
        import pandas as pd

        columns = {"coverage": self.share, "identified": self.identified, "relative standard error": self.error}
        return pd.DataFrame(columns, index=pd.Index(self.parameters, name="parameter"))


def interval_coverage(seed: int, repeats: int = 50) -> Coverage:
    """Repeat the identification of one truth with new noise: 0.1 % on frequencies, 1 % on shapes, 5 % on damping.

    Args:
        seed: of the truth.
        repeats: number of measurements.

    Raises:
        RuntimeError: no fit converged.
    """
    model = reference_machine()
    space, truth = _space(model), _truth(model, seed)
    references = measured_modes(truth, IDENTIFICATION)
    found = [identify_machine(model, noisy(references, number + 1), IDENTIFICATION, space) for number in range(repeats)]
    good = [one for one in found if one.fit.success and not one.unpaired]
    if not good:
        raise RuntimeError(f"None of {repeats} fits converged with all modes paired.")
    seen = np.asarray([[v.kind == IDENTIFIED for v in one.seen.verdicts] for one in good])
    low, high = np.moveaxis(np.asarray([one.fit.intervals() for one in good]), -1, 0)
    true = np.asarray(space.values(truth))
    held = np.sum(seen & (low <= true) & (true <= high), axis=0)
    errors = np.asarray([one.fit.standard_errors / one.fit.values for one in good])
    share = np.divide(held, seen.sum(axis=0), out=np.full(len(space), np.nan), where=seen.any(axis=0))
    return Coverage(space.paths, share, seen.mean(axis=0), np.nanmedian(errors, axis=0), repeats, repeats - len(good))


def conformity_of(model: Machine, truth: Machine, positions: Sequence[float]) -> ConformityStatistics:
    """The statistics of tables 2 to 5: responses of all nodes to forces at the workpiece table, and modes.

    Args:
        model: identified machine.
        truth: the machine that it was identified from.
        positions: axis positions over which the statistics go [m].
    """
    responses = [(response(model, z), response(truth, z)) for z in positions]
    modes = list(zip(measured_modes(model, positions), measured_modes(truth, positions), strict=True))
    return conformity(responses, modes)


def response(machine: Machine, position: float) -> FRF:
    """Receptances of all nodes' translations to forces at the workpiece table, 5 to 500 Hz.

    Args:
        machine: the machine.
        position: axis position [m].
    """
    return _response(machine, jnp.asarray(float(position)), translations(machine))


def permuted_damping(model: Machine, truth: Machine, seed: int = 1) -> Machine:
    """The control of figs. 7 and 9: the same relative deviations of the dampings, dealt to other dampings.

    Args:
        model: identified machine.
        truth: the machine that it was identified from.
        seed: of the permutation, in which no damping keeps its own.
    """
    space = _space(reference_machine()).subset([q.path for q in UNKNOWN if q.kind != "stiffness"])
    true = np.asarray(space.values(truth))
    shares = np.asarray(space.values(model)) / true
    random, order = np.random.default_rng(seed), np.arange(shares.size)
    while np.any(order == np.arange(shares.size)):
        order = random.permutation(shares.size)
    return space.with_values(model, jnp.asarray(true * shares[order]))


def _space(machine: Machine) -> ParameterSpace:
    return unknown_space(machine, scale="log")


@eqx.filter_jit
def _response(machine: Machine, position: jnp.ndarray, outputs: tuple[str, ...]) -> FRF:
    system = machine.second_order(position, inputs=_EXCITATION, outputs=outputs)
    return frequency_response(system, _FREQUENCIES)
