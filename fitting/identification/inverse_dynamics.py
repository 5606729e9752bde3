"""Inverse-dynamics least squares: force regressed on acceleration, speed and direction, as robotics does it."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy import signal

from fitting.fit import fit
from fitting.residuals.linear import LinearResidual
from fitting.result import FitResult
from twin._checks import InputError
from twin.drives import ServoAxis
from twin.laws import AbstractStaticFriction
from twin.parameters import ParameterSpace
from twin.record import Record


@dataclass(frozen=True)
class DerivativeFilter:
    """How speed and acceleration are made from a position record."""

    cutoff: float = 100.0
    """Cutoff of the Butterworth low-pass [Hz], run forwards and backwards."""
    order: int = 4
    """Order of the low-pass."""

    def __call__(self, position: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Filtered position, and its first and second central differences.

        Args:
            position: samples (samples,) [m].
            period: sampling period [s].

        Returns:
            Position, velocity and acceleration (samples,) [m, m/s, m/s²].

        Raises:
            InputError: cutoff beyond the Nyquist frequency, or a record too short for the filter.
        """
        nyquist = 0.5 / period
        if not 0 < self.cutoff < nyquist:
            raise InputError(
                f"The cutoff of {self.cutoff:g} Hz must lie between 0 and the Nyquist frequency {nyquist:g} Hz."
            )
        sections = signal.butter(self.order, self.cutoff / nyquist, output="sos")
        if position.size <= 3 * (self.order + 1):
            raise InputError(f"A record of {position.size} samples is too short for a filter of order {self.order}.")
        smooth = signal.sosfiltfilt(sections, position)
        velocity = np.gradient(smooth, period)
        return smooth, velocity, np.gradient(velocity, period)


def inverse_dynamics(
    record: Record,
    axis: ServoAxis,
    space: ParameterSpace,
    *,
    derivatives: DerivativeFilter | None = None,
    decimation: int = 10,
    edge: int = 50,
) -> FitResult:
    """Least squares on M·a + friction(v) + F(q) + offset = force, for parameters that enter linearly.

    With mass, viscous and Coulomb friction and offset free, this is the procedure published for the EMPS bench (Janot,
    Gautier, Brunot 2019): low-pass and central differences, then every column decimated behind an anti-alias filter.
    It needs no start and no simulation; noise in the derivatives biases it, and it takes the residual for white.

    Args:
        record: channels `position` [m] and `force` [N].
        axis: servo axis whose friction has no memory; give its friction a width far below the speeds of the record.
        space: free parameters; each must enter the force linearly.
        derivatives: low-pass and differences.
        decimation: every how many samples one is kept.
        edge: samples left out at both ends, where the filter settles.

    Returns:
        The fit, its model being the axis with the estimates.

    Raises:
        InputError: friction with memory, a parameter that enters nonlinearly, a missing channel, a record too short.
    """
    if not isinstance(axis.friction, AbstractStaticFriction):
        raise InputError(
            f"{type(axis.friction).__name__} has an internal state; inverse dynamics needs a law of speed alone."
        )
    position = np.asarray(record.channel("position"))
    if position.size - 2 * edge < 10 * decimation * len(space):
        raise InputError(
            f"{position.size} samples are too few for {len(space)} parameters at decimation {decimation} with {edge} "
            "left out at each end. Use a longer record, or decimate less."
        )
    period = float(record.sample_period)
    smooth, velocity, acceleration = (derivatives or DerivativeFilter())(position, period)
    motion = (jnp.asarray(smooth), jnp.asarray(velocity), jnp.asarray(acceleration))
    force = np.asarray(record.channel("force"))

    start = space.values(axis)
    fixed = np.asarray(_resisting(space.with_values(axis, jnp.zeros_like(start)), motion))
    columns = np.asarray(jax.jacfwd(lambda x: _resisting(space.with_values(axis, x), motion))(start))
    _check_linear(columns, np.asarray(_resisting(axis, motion)) - fixed, np.asarray(start), space)

    def keep(samples: np.ndarray) -> np.ndarray:
        inner = samples[edge : samples.shape[0] - edge]
        return signal.decimate(inner, decimation, axis=0) if decimation > 1 else inner

    return fit(LinearResidual(keep(columns), keep(force - fixed), space), axis, space)


def _resisting(axis: ServoAxis, motion: tuple[Array, Array, Array]) -> Float[Array, "samples"]:
    position, velocity, acceleration = motion
    friction = jax.vmap(lambda v, x: axis.friction.force((), v, x))(velocity, position)
    return axis.mass * acceleration + friction + jax.vmap(axis.position_force)(position) + axis.offset


def _check_linear(columns: np.ndarray, force: np.ndarray, values: np.ndarray, space: ParameterSpace) -> None:
    misfit = np.linalg.norm(columns @ values - force)
    if misfit > 1e-9 * max(np.linalg.norm(force), np.finfo(float).tiny):
        raise InputError(
            f"Not all of {', '.join(space.paths)} enter the force linearly. Hold widths, Stribeck speeds and periods "
            "fixed here, or use the output-error procedure."
        )
