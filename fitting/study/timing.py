"""Whether records fit better with their inputs shifted in time: a lag that nobody told, or held samples read as lines.

A drive's software often records the input of the next cycle beside the position of this one, and a digital command is
held from sample to sample, which is half a sample late on average. Either falsifies mass and damping, and shows in
nothing but a residual that no parameter explains.
"""

import dataclasses
from collections.abc import Callable

import equinox as eqx
import numpy as np

from fitting.result import FitResult
from fitting.study.data import RecordData
from fitting.study.evidence import StudyData
from twin.references import SampledReference, SampledSignal

# What is left counts as unexplained above this many standard deviations, and a shift as an explanation if it would
# take away this share of the cost.
_UNEXPLAINED, _EXPLAINED = 2.0, 0.2
# A parabola through the costs of whole samples tells no minimum farther away than this.
_FARTHEST = 3.0


def timing_hint(data: StudyData, result: FitResult, fitted_anew: Callable[[StudyData], FitResult]) -> tuple[str, ...]:
    """A sentence on the shift of the inputs with which the data would fit clearly better; empty if there is none.

    Args:
        data: the fitted data.
        result: the fit.
        fitted_anew: fits other data, from where the fit ended.
    """
    moved = [one for one in data.records if _steps(one) is not None]
    if not moved or len(moved) != len(data.records) or not result.rms > _UNEXPLAINED:
        return ()
    costs = []
    for samples in (-1.0, 1.0):
        shifted = tuple(_shifted(one, samples) for one in data.records)
        costs.append(fitted_anew(dataclasses.replace(data, records=shifted)).cost)
    before, after = costs
    bend = before - 2 * result.cost + after
    best = 0.5 * (before - after) / bend if bend > 0 else np.nan
    drop = 0.25 * (before - after) * best / result.cost if bend > 0 else np.nan
    if not (np.isfinite(best) and abs(best) <= _FARTHEST and drop > _EXPLAINED):
        return ()
    size = f"{abs(best):.2g} samples ({1e3 * abs(best) * float(_steps(moved[0]) or 0.0):.3g} ms)"
    held = all(getattr(one.reference, "interpolation", "") == "hold" for one in moved)
    lines = all(getattr(one.reference, "interpolation", "") == "linear" for one in moved)
    cure = "Look at how the drive's software takes its samples, and give `delay` to a channel."
    if lines and 0.25 < best < 0.75:
        cure = "That is what samples look like which are held until the next: set hold = true."
    if held and -0.75 < best < -0.25:
        cure = "That is what samples look like which are not held: set hold = false."
    return (
        f"The data would fit clearly better if the inputs took effect {size} {'later' if best > 0 else 'earlier'} (the "
        f"squared residual would fall by {100 * min(drop, 1.0):.0f} %). {cure}",
    )


def _steps(one: RecordData) -> float | None:
    """Step of the samples that drove a record; None where it was driven by no samples."""
    if not isinstance(one.reference, SampledSignal | SampledReference):
        return None
    return float(np.median(np.diff(np.asarray(one.reference.times))))


def _shifted(one: RecordData, samples: float) -> RecordData:
    step = _steps(one) or 0.0
    reference = eqx.tree_at(lambda reference: reference.times, one.reference, one.reference.times + samples * step)  # pyright: ignore[reportOptionalMemberAccess, reportAttributeAccessIssue]
    return dataclasses.replace(one, reference=reference)
