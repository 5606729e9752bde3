"""Measured and simulated channels side by side: what the sections on a fit are made from."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import ArrayLike

from fitting.controls.relative_error import relative_error
from twin._checks import InputError
from twin.record import Record


class Compared(NamedTuple):
    """One channel of one record, measured and simulated."""

    record: str
    """Name of the record."""
    channel: str
    """Name of the channel."""
    unit: str
    """Its unit."""
    times: np.ndarray
    """Times (samples,) [s]."""
    measured: np.ndarray
    """Measured samples (samples,)."""
    simulated: np.ndarray
    """Simulated samples (samples,)."""
    deviation: np.ndarray | None
    """Standard deviation of the noise, one number or one for each sample; None where it is not known."""
    speed: tuple[str, str, np.ndarray] | None = None
    """Name, unit and samples of a speed at these times, where the record's own is not to be taken."""

    @property
    def name(self) -> str:
        """Record and channel."""
        return f"{self.record}: {self.channel}"

    @property
    def error(self) -> np.ndarray:
        """Measured minus simulated, in the unit (samples,)."""
        return self.measured - self.simulated

    @property
    def weighted(self) -> np.ndarray | None:
        """The error over the standard deviation [-] (samples,); None where that is not known."""
        return None if self.deviation is None else self.error / self.deviation

    @property
    def rms(self) -> float:
        """Root mean square of the error, in the unit."""
        return float(np.sqrt(np.mean(self.error**2)))

    @property
    def relative(self) -> float:
        """Size of the error over that of the measurement about its mean; NaN for a constant one [-]."""
        return relative_error(self.measured, self.error)


def compared(
    records: Mapping[str, Record],
    simulated: Mapping[str, Mapping[str, ArrayLike]],
    deviation: Mapping[str, Mapping[str, ArrayLike]] | None = None,
) -> tuple[Compared, ...]:
    """Every channel that was simulated, beside its measurement.

    Args:
        records: records by name.
        simulated: simulated samples by record and channel, at the record's times, in the channel's unit.
        deviation: standard deviation of the noise by record and channel, in the channel's unit: a number, or one for
            each sample.

    Raises:
        InputError: a record or channel that is not there, or another number of samples.
    """
    found = []
    for name, channels in simulated.items():
        if name not in records:
            raise InputError(f"simulated names the record {name!r}, but the records are {', '.join(records)}.")
        record = records[name]
        for channel, values in channels.items():
            measured, samples = np.asarray(record.channel(channel)), np.asarray(values, dtype=float)
            if samples.shape != measured.shape:
                raise InputError(
                    f"simulated channel {channel!r} of {name!r} has shape {samples.shape}, but the record has "
                    f"{measured.shape}. Simulate at the record's times."
                )
            sd = (deviation or {}).get(name, {}).get(channel)
            sd = None if sd is None else np.asarray(sd, dtype=float)
            found.append(
                Compared(name, channel, record.units[channel], np.asarray(record.times), measured, samples, sd)
            )
    return tuple(found)
