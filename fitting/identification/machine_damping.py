"""Unknown dampers of a machine from measured damping ratios, by bounded linear least squares.

Source: section 2.3.3, eq. 11 to 13, of J. Ellinger, M. F. Zaeh, Machines 10 (2022) 535.
"""

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import lsq_linear

from fitting.identification.machine_affine import AffineMachine, affine_machine
from fitting.identification.machine_evidence import Evidence, evidence
from fitting.identification.machine_sensitivity import DAMPING, MachineSensitivity
from twin._checks import InputError
from twin.correlation import assign
from twin.modal.reference import ReferenceModes
from twin.parameters import ParameterSpace
from twin.structure import Machine

if TYPE_CHECKING:
    import pandas as pd


@dataclasses.dataclass(frozen=True, repr=False)
class DampingEstimate:
    """Dampings identified, and the equations that they come from."""

    space: ParameterSpace
    """The unknown dampings."""
    value: Float[np.ndarray, "dampings"]
    """Values within their bounds [Ns/m, N/m, Nm/rad]."""
    factors: Float[np.ndarray, "equations dampings"]
    """Q of eq. 13 [1/unit of the value]."""
    residual_damping: Float[np.ndarray, "equations"]
    """What the unknown dampers have to explain, ζ_res of eq. 12 [-]."""
    problems: tuple[str, ...]
    """Names of the reference modes that the equations come from."""
    on_bound: Bool[np.ndarray, "dampings"]
    """Which dampings sit on a bound."""
    rank: int
    """Rank of the weighted equations; less than the number of dampings if some of these are not seen."""

    def machine(self, machine: Machine) -> Machine:
        """A machine with the dampings identified.

        Args:
            machine: machine.
        """
        return self.space.with_values(machine, jnp.asarray(self.value))

    def to_dataframe(self) -> "pd.DataFrame":
        """One row per damping."""
        import pandas as pd

        columns = {"unit": self.space.units, "value": self.value, "on a bound": self.on_bound}
        return pd.DataFrame(columns, index=pd.Index(self.space.paths, name="parameter"))

    def __repr__(self) -> str:
        facts = f"{len(self.problems)} equations of rank {self.rank} for {len(self.space)} dampings."
        return f"{self.to_dataframe().to_string(float_format=lambda x: f'{x:.5g}')}\n{facts}"


def least_disturbed(sensitivity: MachineSensitivity, count: int = 20) -> Bool[np.ndarray, "problems"]:
    """The reference modes whose NDD² depends least on what is not searched together with the dampings: stiffnesses.

    Args:
        sensitivity: Sobol study of the machine.
        count: modes wanted; 20 in the paper.

    Returns:
        Mask of the reference modes of all positions.

    Raises:
        InputError: fewer than one, or more than there are.
    """
    total = sensitivity.total(DAMPING)
    if not 1 <= count <= len(total):
        raise InputError(f"count must be between 1 and {len(total)}, but is {count}.")
    stiff = np.asarray([path.split(".")[2] == "stiffness" for path in sensitivity.indices.names])
    chosen = np.zeros(len(total), dtype=bool)
    chosen[np.argsort(total[:, stiff].sum(axis=1), kind="stable")[:count]] = True
    return chosen


def damping_least_squares(
    machine: Machine,
    references: Sequence[ReferenceModes],
    positions: Sequence[float],
    space: ParameterSpace,
    *,
    rows: Bool[np.ndarray, "problems"] | None = None,
    least: float = 0.0,
    weights: Float[np.ndarray, "problems"] | None = None,
    threshold: float = 0.3,
) -> DampingEstimate:
    """Dampings that explain the measured damping ratios best, within their bounds.

    Args:
        machine: machine with the stiffnesses identified; its values of the unknown dampings play no part.
        references: reference modes, one set for each position.
        positions: axis positions [m].
        space: unknown parameters; dampings are estimated, stiffnesses taken from the machine.
        rows: reference modes to use, position by position, as of `least_disturbed`; all if not given.
        least: residual damping ζ_res below which a row is dropped [-]; 0.005 in the paper, and at 0 none is.
        weights: weight of each reference mode's equation; 1 over its damping ratio if not given, so that errors count
            as shares.
        threshold: least MACXP of the mode that an equation is made with; a reference mode without one is left out.

    Returns:
        The estimate.

    Raises:
        InputError: no unknown damping, a mask or weights of another length, no equation left, and as `solve_parts`.
    """
    data = evidence(references, positions)
    count = sum(one.omega.size for one in data)
    chosen = np.ones(count, dtype=bool) if rows is None else np.asarray(rows, dtype=bool)
    ratios = np.concatenate([one.ratio for one in data])
    weight = 1 / ratios if weights is None else np.asarray(weights, dtype=float)
    for name, array in (("rows", chosen), ("weights", weight)):
        if array.shape != (count,):
            raise InputError(f"{name} has shape {array.shape}, but there are {count} reference modes.")
    if not (np.isfinite(weight).all() and (weight >= 0).all()):
        raise InputError("weights must be finite and not negative. Leave a mode out by weight 0, or by rows.")
    parts = [affine_machine(machine, space, one.position, one.outputs) for one in data]
    numbers = parts[0].damping
    if numbers.size == 0:
        raise InputError("The space has no damping. Add joints.<name>.viscous or hysteretic.<direction>.")
    stiffness = np.asarray(space.values(machine))[parts[0].stiffness]
    pieces = [_equations(part, one, stiffness, threshold) for part, one in zip(parts, data, strict=True)]
    factors, known, paired = (np.concatenate(arrays) for arrays in zip(*pieces, strict=True))
    rest = ratios - known  # eq. 12
    kept = chosen & paired & (weight > 0) & ((rest >= least) | (least <= 0))
    if not kept.any():
        raise InputError(
            f"No equation is left of {chosen.sum()}: {np.sum(chosen & ~paired)} modes are not paired, and residual "
            f"damping reaches {np.max(rest):.3g} where {least:g} is asked for. Choose more rows, or a smaller least."
        )
    own = space.subset([space.paths[i] for i in numbers])
    bounds = np.asarray([(p.lower, p.upper) for p in own.parameters])
    width = bounds[:, 1] - bounds[:, 0]
    matrix = weight[kept, None] * factors[kept] * width
    found = lsq_linear(matrix, weight[kept] * (rest[kept] - factors[kept] @ bounds[:, 0]), (0.0, 1.0), method="bvls")
    labels = [label for one in data for label in one.labels]
    return DampingEstimate(
        own,
        bounds[:, 0] + found.x * width,
        factors[kept],
        rest[kept],
        tuple(label for label, keep in zip(labels, kept, strict=True) if keep),
        found.active_mask != 0,
        int(np.linalg.matrix_rank(matrix)),
    )


def _equations(part: AffineMachine, one: Evidence, stiffness: np.ndarray, threshold: float) -> tuple[np.ndarray, ...]:
    """Q, known damping ratio, and whether there is a mode, for each reference mode at one position."""
    values, shapes = np.linalg.eigh(part.stiffness_matrices(stiffness[None]))
    pairs = assign(one.alike(values, shapes, part.output_map)[0], threshold=threshold)
    paired = np.asarray(pairs.paired)
    order = np.maximum(np.asarray(pairs.order), 0)
    omega = np.sqrt(np.maximum(values[:, order], np.finfo(float).tiny))
    known, factors = part.damping_ratios(omega, shapes[:, :, order])
    return factors[0], known[0], paired
