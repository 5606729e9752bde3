"""Evidence from records over time: simulated minus measured, channel by channel."""

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from fitting.residuals.residual import AbstractResidual
from twin._checks import InputError, positive
from twin.record import Record
from twin.references import AbstractReference
from twin.simulation import simulate
from twin.stepping import AbstractStepping


class TrajectoryResidual(AbstractResidual):
    """(simulated - measured) / standard deviation, for some channels of a record, stacked.

    The model is a plant, a closed loop or a sampled loop that `simulate` accepts; channels are outputs of it. A
    simulation that fails gives NaN, which a solver takes as a step not to be made.
    """

    times: Float[Array, "times"]
    """Times of the record [s]."""
    reference: AbstractReference
    """What drove the system while it was measured."""
    measured: tuple[Float[Array, "times"], ...]
    """Measured samples, one vector per channel."""
    deviation: tuple[Float[Array, ""] | Float[Array, "times"], ...]
    """Standard deviation of each channel's noise, in the channel's unit, one for all samples or one for each: one over
    the weight."""
    channels: tuple[str, ...] = eqx.field(static=True)
    """Names of the outputs compared."""
    stepping: AbstractStepping | None = None
    """How time is stepped; as in `simulate`."""

    @staticmethod
    def create(
        record: Record,
        reference: AbstractReference,
        deviation: Mapping[str, ArrayLike],
        *,
        stepping: AbstractStepping | None = None,
    ) -> "TrajectoryResidual":
        """Evidence from a record.

        Args:
            record: measured channels, named as the outputs of the system.
            reference: what drove the system.
            deviation: standard deviation per channel to compare, in the channel's SI unit: a number, or one for each
                sample (samples,). `twin.repeats.repeated` gives it from repeated records.
            stepping: how time is stepped.

        Raises:
            InputError: no channel, a channel that the record does not have, a deviation that is not positive, or of
                another length.
        """
        if not deviation:
            raise InputError("Name at least one channel to compare, with the standard deviation of its noise.")
        for name, value in deviation.items():
            _check_deviation(name, value, record)
        return TrajectoryResidual(
            times=record.times,
            reference=reference,
            measured=tuple(record.channel(name) for name in deviation),
            deviation=tuple(jnp.asarray(value, dtype=jnp.float64) for value in deviation.values()),
            channels=tuple(deviation),
            stepping=stepping,
        )

    def __call__(self, model: Any) -> Float[Array, "residuals"]:
        trajectory = simulate(model, self.reference, self.times, stepping=self.stepping)
        parts = [
            (trajectory.channel(name) - samples) / sd
            for name, samples, sd in zip(self.channels, self.measured, self.deviation, strict=True)
        ]
        return jnp.concatenate(parts)


def _check_deviation(name: str, value: ArrayLike, record: Record) -> None:
    what = f"deviation of channel {name!r}"
    samples = record.channel(name).size
    if np.shape(value) not in ((), (samples,)):
        raise InputError(
            f"{what} has shape {np.shape(value)}, but the channel has {samples} samples. Give one number, or one for "
            "each sample."
        )
    positive(what, value, record.units[name])


def relative_error_percent(measured: Float[ArrayLike, "measured"], simulated: Float[ArrayLike, "simulated"]) -> float:
    """100·‖measured - simulated‖ / ‖measured‖.

    Args:
        measured: samples (samples,).
        simulated: samples (samples,), in the same unit.

    Raises:
        InputError: lengths differ, or nothing was measured.
    """
    m, s = np.asarray(measured), np.asarray(simulated)
    if m.shape != s.shape:
        raise InputError(f"measured has shape {m.shape}, simulated {s.shape}; compare the same samples.")
    size = np.linalg.norm(m)
    if size == 0:
        raise InputError("The measured channel is zero throughout: a relative error has no meaning.")
    return float(100 * np.linalg.norm(m - s) / size)
