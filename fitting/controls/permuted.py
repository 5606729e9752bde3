"""The control by shuffled data: does the fit depend on what was measured when?"""

import dataclasses
from typing import Any, NamedTuple

import numpy as np

from fitting.controls.held_back import rms_of, short
from fitting.controls.parts import with_parts
from fitting.fit import fit
from fitting.residuals.frequency_response import FrequencyResponseResidual
from fitting.residuals.linear import LinearResidual
from fitting.residuals.residual import AbstractResidual
from fitting.residuals.trajectory import TrajectoryResidual
from twin._checks import InputError
from twin.parameters import ParameterSpace

# Blocks must be many enough to be shuffled, whatever the signal remembers.
_LEAST_BLOCKS = 6
# A signal has forgotten where its autocorrelation falls below this.
_FORGOTTEN = 0.2


class Permuted(NamedTuple):
    """What the same fit makes of data whose blocks were shuffled in time, or along the frequency."""

    name: str
    """Name of the control."""
    fitted_rms: float
    """Root mean square of the weighted residual of the fit to the data as they are [-]."""
    rms: float
    """The same of the fit to the shuffled data [-]; infinite where no fit was possible."""
    limit: float
    """Ratio from which the control passes [-]."""
    stop: str
    """Why the fit to the shuffled data stopped, as in `FitResult.stop`."""

    @property
    def ratio(self) -> float:
        """By how much shuffled data are described worse [-]."""
        return self.rms / self.fitted_rms if self.fitted_rms > 0 else float("inf")

    @property
    def passed(self) -> bool:
        """Whether the shuffled data are described much worse, as they should be."""
        return bool(self.ratio >= self.limit)

    @property
    def sentence(self) -> str:
        """The result in words."""
        size = f"a weighted residual of {short(self.rms)} against {short(self.fitted_rms)}"
        if self.passed:
            return f"Shuffled data are not described, as it should be: {size}."
        return (
            f"Shuffled data are described nearly as well as the true ones: {size}. What the model explains it would "
            "explain in any data, or it explains next to nothing; do not trust its parameters. Free fewer of them, or "
            "measure with more excitation."
        )


def permuted_control(
    evidence: AbstractResidual,
    model: Any,
    space: ParameterSpace,
    fitted: Any,
    *,
    block: int | None = None,
    seed: int = 1,
    limit: float = 2.0,
    max_steps: int = 50,
) -> Permuted:
    """Fit again, to the same data with their blocks shuffled. It must not succeed.

    Args:
        evidence: joint, selected, weighted or robust evidence of records and frequency responses. Other evidence in it
            stays as it is.
        model: start of the fit.
        space: free parameters.
        fitted: the model fitted to the data as they are.
        block: as in `shuffled`.
        seed: as in `shuffled`.
        limit: by how much the fit must be worse for the control to pass, above 1.
        max_steps: as in `fitting.fit.fit`.

    Raises:
        InputError: as `shuffled` and `fitting.fit.fit`, or a limit of 1 or below.
    """
    if not limit > 1:
        raise InputError(f"limit must be above 1, but is {limit}.")
    mixed = shuffled(evidence, block=block, seed=seed)
    result = fit(mixed, model, space, max_steps=max_steps)
    return Permuted("shuffled", rms_of(evidence, fitted), rms_of(mixed, result.model), limit, result.stop)


def shuffled(evidence: AbstractResidual, *, block: int | None = None, seed: int = 1) -> AbstractResidual:
    """The evidence with what was measured shuffled in blocks; what drove the system stays as it is.

    All channels of a record are shuffled alike. No block stays in its place.

    Args:
        evidence: as in `permuted_control`.
        block: samples, or lines of a frequency response, that stay together: at least as many as the data remember. By
            default where their autocorrelation falls below 0.2, but at most a sixth of them.
        seed: of the order; the same seed gives the same order.

    Raises:
        InputError: neither a record nor a response, a block below one sample, fewer than two blocks.
    """
    random = np.random.default_rng(seed)

    def record(residual: TrajectoryResidual) -> TrajectoryResidual:
        order = _order([np.asarray(x) for x in residual.measured], block, random)
        return dataclasses.replace(residual, measured=tuple(samples[order] for samples in residual.measured))

    def response(residual: FrequencyResponseResidual) -> FrequencyResponseResidual:
        measured = residual.measured
        rows = list(np.asarray(measured.values).reshape(-1, measured.frequency.size))
        order = _order(rows, block, random)
        variance = None if measured.variance is None else measured.variance[..., order]
        mixed = dataclasses.replace(measured, values=measured.values[..., order], variance=variance)
        return dataclasses.replace(residual, measured=mixed)

    def rows(residual: LinearResidual) -> LinearResidual:
        order = _order([np.asarray(residual.target)], block, random)
        return dataclasses.replace(residual, target=residual.target[order])

    return with_parts(evidence, record, response, rows)


def _order(rows: list[np.ndarray], block: int | None, random: np.random.Generator) -> np.ndarray:
    count = rows[0].size
    if block is None:
        block = min(max(map(_memory, rows)), max(count // _LEAST_BLOCKS, 1))
    if block < 1 or 2 * block > count:
        raise InputError(f"block is {block}, but must be at least 1 and at most half of the {count} samples or lines.")
    parts = np.array_split(np.arange(count), count // block)
    # A cycle through all blocks, so that none stays in its place.
    cycle = random.permutation(len(parts))
    target = np.empty_like(cycle)
    target[cycle] = np.roll(cycle, 1)
    return np.concatenate([parts[i] for i in target])


def _memory(values: np.ndarray) -> int:
    """Samples after which a signal has forgotten where it was."""
    moving = values - values.mean()
    spectrum = np.fft.fft(moving, 2 * values.size)
    covariance = np.real(np.fft.ifft(np.abs(spectrum) ** 2))[: values.size]
    if covariance[0] <= 0:
        return 1
    low = np.flatnonzero(covariance < _FORGOTTEN * covariance[0])
    return max(int(low[0]), 1) if low.size else values.size
