"""Repeated records: their mean, and the standard deviation that the repeats show, to weight a fit by."""

from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from twin._checks import InputError
from twin.record import Record

# How far the same sample of two repeats may lie apart, in sample periods.
_TIME_ROUNDING = 1e-3
# One over a variance estimated from R repeats has a finite mean from 4 repeats on, a finite variance from 6.
_REPEATS_FOR_SAMPLES = 6


class Repeated(NamedTuple):
    """What several repeats of one experiment say together."""

    mean: Record
    """Mean of the repeats."""
    deviation: dict[str, Float[Array, ""] | Float[Array, " samples"]]
    """Standard deviation of the mean of each channel, in the channel's unit: of all samples together, or of each."""
    repeats: int
    """Number of repeats."""


def repeated(
    records: Sequence[Record], *, channels: Sequence[str] | None = None, each_sample: bool = False
) -> Repeated:
    """The mean of repeated records, and how well the repeats say it is known.

    The deviation is that of the mean, 1/√repeats of that of one record, so that it weights a fit to the mean. It holds
    what differs from repeat to repeat; what every repeat has in common, as a model error, is not in it. The repeats
    count as independent.

    Args:
        records: repeats, sampled at the same times.
        channels: channels whose deviation is wanted; all by default. A command that is the same in every repeat has
            none: leave it out here.
        each_sample: a deviation for each sample rather than one for the channel; for noise that varies along the
            record. It takes at least 6 repeats: weights from fewer scatter so much that they do harm.

    Raises:
        InputError: fewer than 2 repeats (6 for `each_sample`), times, channels or units that differ, an unknown
            channel, a channel without scatter.
    """
    least = _REPEATS_FOR_SAMPLES if each_sample else 2
    if len(records) < least:
        why = "weights for each sample" if each_sample else "a deviation"
        raise InputError(f"{why} from repeats takes at least {least} records, but there are {len(records)}.")
    first = records[0]
    for number, record in enumerate(records[1:], start=1):
        _check_same(first, record, number)
    wanted = tuple(first.channels) if channels is None else channels
    deviation = {}
    for name in wanted:
        samples = np.stack([np.asarray(record.channel(name)) for record in records])
        variance = samples.var(axis=0, ddof=1) / len(records)
        found = np.sqrt(variance if each_sample else variance.mean())
        if not np.all(found > 0):
            raise InputError(
                f"channel {name!r} has samples that are the same in all {len(records)} repeats, so that they would get "
                "infinite weight. Leave a command out by naming channels; otherwise give this deviation yourself."
            )
        deviation[name] = jnp.asarray(found)
    means = {name: np.mean([np.asarray(r.channels[name]) for r in records], axis=0) for name in first.channels}
    mean = Record.create(first.times, means, first.units, name=f"mean of {len(records)} of {first.name}")
    return Repeated(mean, deviation, len(records))


def split_periods(record: Record, period_samples: int, *, skip: int = 0) -> tuple[Record, ...]:
    """The periods of a record of a periodic excitation, as repeats on the time axis of the last one.

    Periods are laid back from the end, so that what is left over lies in the transient at the beginning.

    Args:
        record: sampled in step with the excitation.
        period_samples: samples in one period.
        skip: complete periods to leave out at the beginning, while the transient dies away.

    Raises:
        InputError: fewer than 8 samples in a period, or fewer than 2 periods left.
    """
    count = record.times.size // max(period_samples, 1)
    if period_samples < 8 or not 0 <= skip <= count - 2:
        raise InputError(
            f"{record.name} has {record.times.size} samples; with period_samples = {period_samples} and skip = {skip} "
            "no two periods of at least 8 samples are left. Record longer, skip fewer, or check period_samples."
        )
    times = record.times[-period_samples:]
    start = record.times.size - count * period_samples
    found = []
    for number in range(skip, count):
        places = slice(start + number * period_samples, start + (number + 1) * period_samples)
        samples = {name: values[places] for name, values in record.channels.items()}
        found.append(Record(times, samples, record.channel_units, f"period {number} of {record.name}"))
    return tuple(found)


def _check_same(first: Record, other: Record, number: int) -> None:
    if other.times.shape != first.times.shape:
        raise InputError(
            f"repeat {number} has {other.times.size} samples, the first {first.times.size}. Cut all to the same times."
        )
    miss = np.abs(np.asarray(other.times - first.times))
    if miss.max() > _TIME_ROUNDING * float(first.sample_period):
        at = int(miss.argmax())
        raise InputError(
            f"repeat {number} is sampled at other times: sample {at} at {float(other.times[at]):g} s, in the first at "
            f"{float(first.times[at]):g} s. Let all begin at the same time, or resample them."
        )
    if other.units != first.units:
        raise InputError(
            f"repeat {number} has the channels {other.units}, the first {first.units}. Use the same channels and units."
        )
