"""Noise that was read from records, lowered to what a fit leaves of them.

What scatters from sample to sample is told from what is smooth by differences (`noise`); a fast motion or a coarse
counter looks like scatter to them. Noise cannot be larger than what the model leaves unexplained: where it was taken to
be, a channel counted for too little beside the others. The other way round nothing is changed: what is left over above
the noise is what the model lacks, and is to be said.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from fitting.study.data import RecordData
from fitting.study.evidence import StudyData, simulate_record
from fitting.study.noise import LEAST

# What is left counts as less noise below this share of what was taken.
_CLEARLY = 0.67


def lowered_noise(data: StudyData, fitted: Sequence[str], model: Any) -> StudyData | None:
    """The data with less noise on channels of which the fit leaves less than was taken for noise.

    A channel is lowered by one factor in all records, those held back too.

    Args:
        data: all data.
        fitted: names of those that were fitted.
        model: the fitted model.

    Returns:
        The data; None if no channel is to be lowered.
    """
    shares: dict[str, list[float]] = {}
    for one in data.records:
        if one.name not in fitted or not one.noise_read:
            continue
        simulated = simulate_record(model, one)
        for channel in one.noise_read:
            left = np.asarray(one.record.channel(channel)) - np.asarray(simulated.channel(channel))
            shares.setdefault(channel, []).append(float(np.mean(left**2)) / one.deviation[channel] ** 2)
    factors = {channel: float(np.sqrt(np.mean(found))) for channel, found in shares.items()}
    factors = {channel: factor for channel, factor in factors.items() if factor < _CLEARLY}
    records = tuple(_lowered(one, factors) for one in data.records)
    changed = any(new.deviation != old.deviation for new, old in zip(records, data.records, strict=True))
    return dataclasses.replace(data, records=records) if changed else None


def _lowered(one: RecordData, factors: dict[str, float]) -> RecordData:
    deviation, remarks = dict(one.deviation), []
    for channel in one.noise_read:
        if channel in factors:
            least = LEAST * float(np.ptp(np.asarray(one.record.channel(channel))))
            deviation[channel] = max(factors[channel] * deviation[channel], least)
            if deviation[channel] < one.deviation[channel]:
                unit = one.record.units[channel]
                remarks.append(
                    f"{one.name}: noise of {channel} lowered to {deviation[channel]:.3g} {unit}: no more is left."
                )
    return dataclasses.replace(one, deviation=deviation, remarks=(*one.remarks, *remarks))
