"""Inverse-dynamics least squares: force regressed on acceleration, speed and direction, as robotics does it."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy import ndimage, signal

from fitting.fit import fit
from fitting.residuals.linear import LinearResidual
from fitting.result import FitResult
from twin._checks import InputError
from twin.drives import ServoAxis
from twin.laws import AbstractStaticFriction
from twin.parameters import ParameterSpace
from twin.record import Record

# Share of the top speed below which an axis creeps, and standard deviations of noise that are no motion.
_SHARE, _CHANCE = 0.02, 4.0
# Rows over which the anti-alias filter rings after a jump, such as that of friction where motion begins.
_RINGING = 3
# Speeds at which a force is looked at.
_LOOKED = 100


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


@dataclass(frozen=True)
class ForceRegression:
    """A record turned into rows that are linear in the free parameters: filtered, decimated, slow ones left out."""

    times: np.ndarray
    """Time of each row (rows,) [s]."""
    velocity: np.ndarray
    """Velocity (rows,) [m/s or rad/s]."""
    force: np.ndarray
    """Measured force (rows,) [N or Nm]."""
    known: np.ndarray
    """Force of what is not free (rows,) [N or Nm]."""
    columns: np.ndarray
    """Force per unit of each free parameter (rows, parameters)."""
    slowest: float
    """Speed below which rows were left out [m/s or rad/s]."""
    left_out: int
    """How many rows that were."""

    def residual(self, space: ParameterSpace, deviation: float = 1.0) -> LinearResidual:
        """The rows as evidence.

        Args:
            space: the free parameters, in the order of the columns.
            deviation: standard deviation of the force in a row [N or Nm].
        """
        return LinearResidual(self.columns / deviation, (self.force - self.known) / deviation, space, "force")

    def modelled(self, values: np.ndarray) -> np.ndarray:
        """Force of the model in each row (rows,) [N or Nm].

        Args:
            values: the free parameters, SI.
        """
        return self.known + self.columns @ values


def inverse_dynamics(
    record: Record,
    axis: ServoAxis,
    space: ParameterSpace,
    *,
    derivatives: DerivativeFilter | None = None,
    decimation: int = 10,
    edge: int = 50,
    slowest: float = 0.0,
    deviation: float = 1.0,
    correlated: bool = False,
) -> FitResult:
    """Least squares on M·a + friction(v) + F(q) + offset = force, for parameters that enter linearly.

    With mass, viscous and Coulomb friction and offset free, this is the procedure published for the EMPS bench (Janot,
    Gautier, Brunot 2019): low-pass and central differences, then every column decimated behind an anti-alias filter.
    It needs no start and no simulation; noise in the derivatives biases it. As published it keeps samples at
    standstill, whose friction is anything up to breakaway, and takes the residual for white.

    Args:
        record: as in `force_regression`.
        axis: as in `force_regression`.
        space: as in `force_regression`.
        derivatives: as in `force_regression`.
        decimation: as in `force_regression`.
        edge: as in `force_regression`.
        slowest: as in `force_regression`.
        deviation: standard deviation of the force in a row, which the residual is in units of [N or Nm].
        correlated: whether standard errors allow for errors that hang together from row to row.

    Returns:
        The fit, its model being the axis with the estimates.

    Raises:
        InputError: as `force_regression`.
    """
    rows = force_regression(
        record, axis, space, derivatives=derivatives, decimation=decimation, edge=edge, slowest=slowest
    )
    return fit(rows.residual(space, deviation), axis, space, correlated=1 if correlated else None)


def force_regression(
    record: Record,
    axis: ServoAxis,
    space: ParameterSpace,
    *,
    derivatives: DerivativeFilter | None = None,
    decimation: int = 10,
    edge: int = 50,
    slowest: float = 0.0,
) -> ForceRegression:
    """The rows of inverse dynamics.

    Args:
        record: channels `position` [m] and `force` [N].
        axis: servo axis whose friction has no memory; give its friction a width far below the speeds of the record.
        space: free parameters; each must enter the force linearly.
        derivatives: low-pass and differences.
        decimation: every how many samples one is kept.
        edge: samples left out at both ends, where the filter settles.
        slowest: rows are left out where the axis is slower than this at any sample that goes into them [m/s].

    Raises:
        InputError: friction with memory, a parameter that enters nonlinearly, a missing channel, a record too short, or
            too few rows that are fast enough.
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

    curved = nonlinear_parameters(axis, space, velocity)
    if curved:
        raise InputError(
            f"{', '.join(curved)} {'does' if len(curved) == 1 else 'do'} not enter the force linearly. Hold widths, "
            "Stribeck speeds and periods fixed here, or use the output-error procedure."
        )
    start = space.values(axis)
    fixed = np.asarray(_resisting(space.with_values(axis, jnp.zeros_like(start)), motion))
    columns = np.asarray(jax.jacfwd(lambda x: _resisting(space.with_values(axis, x), motion))(start))
    _check_linear(
        columns, np.asarray(_resisting(space.with_values(axis, start), motion)) - fixed, np.asarray(start), space
    )

    inner = slice(edge, position.size - edge)

    def keep(samples: np.ndarray) -> np.ndarray:
        return signal.decimate(samples[inner], decimation, axis=0) if decimation > 1 else samples[inner]

    reach = _RINGING * decimation if decimation > 1 else 0
    around = ndimage.minimum_filter1d(np.abs(velocity), 2 * reach + 1)
    fast = around[inner][::decimation] >= slowest
    if np.count_nonzero(fast) < 2 * len(space):
        raise InputError(
            f"Only {np.count_nonzero(fast)} of {fast.size} rows are as fast as {slowest:.3g} {record.units['position']}"
            f"/s, too few for {len(space)} parameters. Lower `slowest`, or use a record with faster motion."
        )
    return ForceRegression(
        times=np.asarray(record.times)[inner][::decimation][fast],
        velocity=velocity[inner][::decimation][fast],
        force=keep(force)[fast],
        known=keep(fixed)[fast],
        columns=keep(columns)[fast],
        slowest=slowest,
        left_out=int(np.count_nonzero(~fast)),
    )


def row_noise(decimation: int) -> float:
    """Standard deviation of a row per standard deviation of white noise on the samples [-].

    Args:
        decimation: as in `force_regression`.
    """
    if decimation == 1:
        return 1.0
    # An impulse at each of the samples that go into one row.
    impulses = np.eye(200 * decimation, decimation, k=-100 * decimation)
    return float(np.linalg.norm(signal.decimate(impulses, decimation, axis=0)))


def moving_speed(record: Record, derivatives: DerivativeFilter | None = None, *, deviation: float = 0.0) -> float:
    """Speed above which a record shows motion rather than standstill or creep [m/s or rad/s].

    A fiftieth of the top speed, but at least four standard deviations of the noise that the derivative has.

    Args:
        record: with the channel `position`.
        derivatives: low-pass and differences.
        deviation: standard deviation of the noise on the position [m or rad].

    Raises:
        InputError: as `DerivativeFilter`.
    """
    chosen, period = derivatives or DerivativeFilter(), float(record.sample_period)
    velocity = chosen(np.asarray(record.channel("position")), period)[1]
    impulse = np.zeros(max(round(20 / (chosen.cutoff * period)), 100))
    impulse[impulse.size // 2] = 1.0
    noise = deviation * float(np.linalg.norm(chosen(impulse, period)[1]))
    return max(_SHARE * float(np.max(np.abs(velocity))), _CHANCE * noise)


def nonlinear_parameters(axis: ServoAxis, space: ParameterSpace, velocity: np.ndarray) -> tuple[str, ...]:
    """Paths of the free parameters that the force is not linear in, each for itself.

    Args:
        axis: the axis.
        space: the free parameters.
        velocity: velocities at which it moves (samples,) [m/s or rad/s].
    """
    speeds = np.geomspace(1e-4, 1.0, _LOOKED) * float(np.max(np.abs(velocity)))
    few = jnp.asarray(np.concatenate([-speeds, speeds]))
    motion = (jnp.zeros_like(few), few, jnp.ones_like(few))
    start = np.asarray(space.values(axis))

    def slope(i: int, value: float) -> np.ndarray:
        def force(x: Array) -> Array:
            return _resisting(space.with_values(axis, jnp.asarray(start).at[i].set(x)), motion)

        return np.asarray(jax.jacfwd(force)(jnp.asarray(value)))

    found = []
    for i, path in enumerate(space.paths):
        here, there = slope(i, start[i]), slope(i, 1.5 * start[i] if start[i] else 1.0)
        if not np.allclose(here, there, rtol=1e-9, atol=1e-12 * float(np.max(np.abs(here), initial=0.0))):
            found.append(path)
    return tuple(found)


def _resisting(axis: ServoAxis, motion: tuple[Array, Array, Array]) -> Float[Array, "samples"]:
    position, velocity, acceleration = motion
    friction = jax.vmap(lambda v, x: axis.friction.force((), v, x))(velocity, position)
    return axis.mass * acceleration + friction + jax.vmap(axis.position_force)(position) + axis.offset


def _check_linear(columns: np.ndarray, force: np.ndarray, values: np.ndarray, space: ParameterSpace) -> None:
    misfit = np.linalg.norm(columns @ values - force)
    if not misfit <= 1e-9 * max(np.linalg.norm(force), np.finfo(float).tiny):
        raise InputError(
            f"Not all of {', '.join(space.paths)} enter the force linearly: some of them multiply each other. Hold all "
            "but one of these fixed here, or use the output-error procedure."
        )
