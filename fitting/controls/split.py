"""Evidence divided into what is fitted and what is held back."""

import dataclasses
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from fitting.controls.parts import with_parts
from fitting.residuals.frequency_response import FrequencyResponseResidual
from fitting.residuals.linear import LinearResidual
from fitting.residuals.residual import AbstractResidual
from fitting.residuals.trajectory import TrajectoryResidual
from fitting.residuals.weighted import Weighted
from twin._checks import InputError
from twin.frf import FRF

_LEAST = 8


class Split(NamedTuple):
    """Evidence in two parts."""

    fitted: AbstractResidual
    """What to fit."""
    kept: AbstractResidual
    """What to predict. Its simulations run from the beginning of the record, but only the part held back counts."""


def hold_back(evidence: AbstractResidual, *, share: float = 0.25) -> Split:
    """Hold back the last part of each record or set of rows, and evenly spread lines of each frequency response.

    A record is cut, not thinned: neighbouring samples know of each other, and would give away what is held back. Of a
    response every few lines are held back, as a model can not be asked what lies beyond its band. Other evidence, such
    as modes or a prior, is fitted and not held back.

    Args:
        evidence: joint, selected, weighted or robust evidence of records and frequency responses.
        share: share to hold back, between 0 and a half.

    Raises:
        InputError: another share, neither a record nor a response, fewer than 8 samples or lines in a part.
    """
    if not 0 < share <= 0.5:
        raise InputError(f"share must be above 0 and at most 0.5, but is {share}.")
    fitted = with_parts(
        evidence, lambda r: _beginning(r, share), lambda r: _lines(r, share)[0], lambda r: _rows(r, share)[0]
    )
    kept = with_parts(
        evidence,
        lambda r: _end(r, share),
        lambda r: _lines(r, share)[1],
        lambda r: _rows(r, share)[1],
        lambda other: Weighted(other, jnp.inf),
    )
    return Split(fitted, kept)


def _cut(residual: TrajectoryResidual, share: float) -> int:
    count = residual.times.size
    cut = round((1 - share) * count)
    _check_parts("samples of a record", cut, count - cut)
    return cut


def _beginning(residual: TrajectoryResidual, share: float) -> TrajectoryResidual:
    cut = _cut(residual, share)
    return dataclasses.replace(
        residual,
        times=residual.times[:cut],
        measured=tuple(samples[:cut] for samples in residual.measured),
        deviation=tuple(sd[:cut] if sd.ndim else sd for sd in residual.deviation),
    )


def _end(residual: TrajectoryResidual, share: float) -> TrajectoryResidual:
    # An infinite deviation is a weight of zero.
    early = jnp.arange(residual.times.size) < _cut(residual, share)
    return dataclasses.replace(residual, deviation=tuple(jnp.where(early, jnp.inf, sd) for sd in residual.deviation))


def _rows(residual: LinearResidual, share: float) -> tuple[LinearResidual, ...]:
    count = residual.target.size
    cut = round((1 - share) * count)
    _check_parts("rows", cut, count - cut)
    return tuple(
        dataclasses.replace(residual, regressors=residual.regressors[part], target=residual.target[part])
        for part in (slice(cut), slice(cut, None))
    )


def _lines(residual: FrequencyResponseResidual, share: float) -> tuple[FrequencyResponseResidual, ...]:
    measured = residual.measured
    every = round(1 / share)
    held = np.arange(measured.frequency.size) % every == every // 2
    _check_parts("lines of a frequency response", int(np.sum(~held)), int(np.sum(held)))
    return tuple(dataclasses.replace(residual, measured=_picked(measured, np.flatnonzero(x))) for x in (~held, held))


def _picked(frf: FRF, lines: np.ndarray) -> FRF:
    variance = None if frf.variance is None else frf.variance[..., lines]
    return dataclasses.replace(frf, frequency=frf.frequency[lines], values=frf.values[..., lines], variance=variance)


def _check_parts(what: str, fitted: int, kept: int) -> None:
    if min(fitted, kept) < _LEAST:
        raise InputError(
            f"{fitted} {what} would be fitted and {kept} held back, but each part needs at least {_LEAST}. Measure "
            "longer, or change the share."
        )
