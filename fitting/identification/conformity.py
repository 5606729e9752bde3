"""How far a model conforms with reference data: FRAC, CSF, MACXP and NDD over all responses and modes, as a table."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import ArrayLike, Float

from twin._checks import InputError
from twin.correlation import csf, frac, ndd, pair_modes
from twin.frf import FRF
from twin.modal import DampedModes, Modes, ReferenceModes

if TYPE_CHECKING:
    import pandas as pd

AnyModes = Modes | DampedModes | ReferenceModes


@dataclasses.dataclass(frozen=True)
class Statistics:
    """What one measure comes to over all responses, or over all modes."""

    worst: float
    """The worst value [%]: the least likeness, or the largest difference."""
    percentile: float
    """What 5 % of the values are worse than [%], interpolated: the 5th percentile of a likeness, the 95th of a
    difference."""
    mean: float
    """Mean [%]."""
    median: float
    """Median [%]."""


@dataclasses.dataclass(frozen=True, repr=False)
class ConformityStatistics:
    """Statistics of FRAC, CSF, MACXP and NDD. Shows itself as a table in a notebook."""

    frac: Statistics
    """Frequency response assurance criterion, one value for each FRF."""
    csf: Statistics
    """Cross signature scale factor, one value for each FRF."""
    macxp: Statistics
    """Extended modal assurance criterion, one value for each reference mode, paired or not."""
    ndd: Statistics
    """Size of the natural damping difference, one value for each pair of modes."""
    unpaired: int
    """Reference modes that could not be paired; they have no NDD."""

    def to_dict(self) -> dict[str, dict[str, float]]:
        """Numbers by measure and statistic [%]."""
        return {name: dataclasses.asdict(getattr(self, name)) for name in ("frac", "csf", "macxp", "ndd")}

    def to_dataframe(self) -> "pd.DataFrame":
        """Table as the paper prints it: worst, 5 % percentile, mean, median by measure [%]."""
        import pandas as pd

        columns = {f"{name.upper()} in %": list(values.values()) for name, values in self.to_dict().items()}
        return pd.DataFrame(columns, index=["Worst", "5 % percentile", "Mean", "Median"])

    def _repr_html_(self) -> str:
        return self.to_dataframe().to_html(float_format=lambda x: f"{x:.2f}") + self._unpaired_note()

    def __repr__(self) -> str:
        return self.to_dataframe().to_string(float_format=lambda x: f"{x:.2f}") + self._unpaired_note()

    def _unpaired_note(self) -> str:
        return f"\n{self.unpaired} reference modes could not be paired; they have no NDD." if self.unpaired else ""


def conformity(
    responses: Sequence[tuple[FRF, FRF]],
    modes: Sequence[tuple[AnyModes, AnyModes]],
    *,
    outputs: tuple[str, ...] | None = None,
    damping: str = "reference",
    threshold: float = 0.3,
) -> ConformityStatistics:
    """Statistics of what a model makes of several positions, against the reference.

    Args:
        responses: simulated and reference response at each position.
        modes: simulated and reference modes at each position; they are paired by MACXP.
        outputs: names of the rows at which shapes are compared; all of the reference's if not given.
        damping: as `pair_modes`.
        threshold: as `pair_modes`.

    Returns:
        The statistics.

    Raises:
        InputError: no position, a response that is zero throughout, whatever `frac` and `pair_modes` refuse.

    Source: tables 2 to 5 of J. Ellinger, M. F. Zaeh, Machines 10 (2022) 535.
    """
    if not responses or not modes:
        raise InputError(f"There are {len(responses)} pairs of responses and {len(modes)} of modes. Give at least one.")
    pairs = [pair_modes(m, r, outputs=outputs, damping=damping, threshold=threshold) for m, r in modes]
    differences = []
    for (simulated, reference), pair in zip(modes, pairs, strict=True):
        matched, order = np.asarray(pair.paired), np.asarray(pair.order)
        found = np.full(matched.size, np.nan)
        found[matched] = ndd(simulated.damping_ratio[order[matched]], reference.damping_ratio[matched])
        differences.append(found)
    return conformity_statistics(
        np.concatenate([np.ravel(frac(simulated, reference)) for simulated, reference in responses]),
        np.concatenate([np.ravel(csf(simulated, reference)) for simulated, reference in responses]),
        np.concatenate([np.asarray(pair.value) for pair in pairs]),
        np.concatenate(differences),
    )


def conformity_statistics(
    frac: Float[ArrayLike, "..."],
    csf: Float[ArrayLike, "..."],
    macxp: Float[ArrayLike, "..."],
    ndd: Float[ArrayLike, "..."],
) -> ConformityStatistics:
    """Statistics of values already computed; any shapes.

    Args:
        frac: FRAC of all FRFs [-].
        csf: CSF of all FRFs [-].
        macxp: MACXP of all reference modes [-].
        ndd: NDD of the reference modes, of either sign [-]; NaN for those that could not be paired.

    Returns:
        The statistics.

    Raises:
        InputError: no value at all, NaN other than in `ndd`.
    """
    differences = np.abs(np.asarray(ndd, dtype=float)).ravel()
    unpaired = np.isnan(differences)
    return ConformityStatistics(
        _likeness("frac", frac),
        _likeness("csf", csf),
        _likeness("macxp", macxp),
        _statistics(differences[~unpaired], np.max, 95.0),
        int(unpaired.sum()),
    )


def _likeness(name: str, values: ArrayLike) -> Statistics:
    array = np.asarray(values, dtype=float).ravel()
    if array.size == 0 or np.any(np.isnan(array)):
        raise InputError(
            f"{name} has {array.size} values, {np.isnan(array).sum()} of them NaN, as those of a response or a shape "
            "that is zero throughout. Leave such responses out."
        )
    return _statistics(array, np.min, 5.0)


def _statistics(values: np.ndarray, worst: Callable, percent: float) -> Statistics:
    if values.size == 0:
        return Statistics(np.nan, np.nan, np.nan, np.nan)
    found = (worst(values), np.percentile(values, percent), np.mean(values), np.median(values))
    return Statistics(*(100.0 * float(x) for x in found))
