"""Sine sweeps of a preloaded drive: what is read off one record."""

import dataclasses

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from twin._checks import InputError, positive
from twin.frf import FRF
from twin.frf_estimators import estimate_frf
from twin.record import Record

_NEEDED = ("position_1", "position_2", "table_position", "torque_1", "torque_2")
_MOVING = {"position_1": "velocity_1", "position_2": "velocity_2", "table_position": "table_velocity"}


@dataclasses.dataclass(frozen=True)
class PreloadSweep:
    """A record of a preloaded drive while its set velocity is swept.

    Raises:
        InputError: a channel that is missing, a start beyond the end of the record.
    """

    preload_percent: float
    """Preload in per cent of the rated torque."""
    record: Record
    """Positions of both motors behind their gearboxes and of the table [m], torques of both motors [Nm]: channels
    position_1, position_2, table_position, torque_1, torque_2."""
    start: float = 0.0
    """Time at which the sweep begins, after the drive has settled [s]."""
    velocity: float = 0.005
    """Velocity on which the sweep is put [m/s]."""
    end: float | None = None
    """Time at which the sweep, and the steady motion, ends [s]; None: with the record."""

    def __post_init__(self):
        for name in _NEEDED:
            self.record.channel(name)
        if not self.start < float(self.record.times[-1]):
            raise InputError(
                f"The sweep starts at {self.start:g} s, but {self.record.name} ends at "
                f"{float(self.record.times[-1]):g} s. Correct the start."
            )
        if self.end is not None and not self.start < self.end:
            raise InputError(f"The sweep ends at {self.end:g} s, but starts at {self.start:g} s. Correct the end.")

    def during(self) -> Record:
        """The record from the start to the end of the sweep."""
        return self.record.slice(self.start, self.end)

    def motor_torques(self) -> Float[Array, "2"]:
        """Mean torque of each motor during the sweep [Nm]."""
        record = self.during()
        return jnp.stack([jnp.mean(record.channel(name)) for name in ("torque_1", "torque_2")])

    def velocities(self, sample_rate: float) -> Record:
        """Velocities of motors and table during the sweep, by differences of the positions at a lower rate.

        The same difference is formed of all positions, so that it drops out of their ratios. Every so many samples are
        taken as they are: what moves faster than half the lower rate folds back, so filter a record that has such.

        Args:
            sample_rate: rate of the result [Hz].

        Raises:
            InputError: if it is not positive, or the record's rate is no whole multiple of it.
        """
        positive("sample_rate", sample_rate, "Hz")
        ratio = float(self.record.sample_rate) / sample_rate
        every = round(ratio)
        if every < 1 or abs(ratio - every) > 1e-3 * ratio:
            raise InputError(
                f"sample_rate is {sample_rate:g} Hz, but {self.record.name} was sampled at "
                f"{float(self.record.sample_rate):g} Hz. Give a sample_rate that divides it, such as its own."
            )
        record = self.during()
        channels = {
            name: np.diff(np.asarray(record.channel(source))[::every]) * sample_rate for source, name in _MOVING.items()
        }
        return Record.create(
            np.asarray(record.times)[::every][1:],
            channels,
            dict.fromkeys(channels, "m/s"),
            name=f"velocities of {self.record.name}",
        )

    def response(
        self,
        *,
        sample_rate: float = 1000.0,
        estimator: str = "H3",
        window: str = "hamming",
        samples: int = 1024,
        overlap: int = 717,
        band: tuple[float, float] | None = None,
    ) -> FRF:
        """Response V_T/V_1 of the table's velocity to that of motor 1 (Leipe et al., section III).

        Args:
            sample_rate: rate at which velocities are formed [Hz].
            estimator: as `twin.frf_estimators.estimate_frf`; so the others.
            window: kind of window.
            samples: samples of a window.
            overlap: samples that two windows share.
            band: lowest and highest frequency to keep [Hz].

        Raises:
            InputError: as `estimate_frf`.
        """
        return estimate_frf(
            self.velocities(sample_rate),
            ("velocity_1",),
            ("table_velocity",),
            estimator=estimator,
            window=window,
            samples=samples,
            overlap=overlap,
            band=band,
        )
