"""A periodic sum of cosines of velocity: chosen lines, all excited at once."""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, as_array, as_scalar, finite, is_concrete, positive
from twin.references._sampling import check_below_nyquist
from twin.references.reference import AbstractReference, MotionPoint


class Multisine(AbstractReference):
    """A velocity Σ A_k·cos(2π·f_k·(t - t₀) + φ_k) at whole multiples f_k of a base frequency, without a mean.

    Position and acceleration are its exact integral and derivative. It repeats with the period 1/base frequency and has
    neither beginning nor end; at t₀ it passes its start position. An axis that starts from rest needs some periods
    until it repeats too. Put it on a motion by `SumReference` to keep the axis from turning back.

    Raises:
        InputError: if a line is not a whole positive number, lines do not increase, lengths differ, the base frequency
            is not positive, or a value is not finite.
    """

    base_frequency: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Base frequency [Hz], the inverse of the period."""
    amplitude: Float[Array, " lines"] = eqx.field(converter=as_array)
    """Amplitudes A_k of the velocity, shape (lines,) [m/s or rad/s]."""
    phase: Float[Array, " lines"] = eqx.field(converter=as_array)
    """Phases φ_k, shape (lines,) [rad]."""
    lines: tuple[int, ...] = eqx.field(static=True)
    """Multiples of the base frequency, increasing, from 1."""
    start_time: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Time t₀ to which the phases belong [s]."""
    start_position: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Position at t₀ [m or rad]; zero where the multisine is added to another motion."""

    def __init__(
        self,
        base_frequency: Float[ArrayLike, ""],
        lines: Sequence[int] | np.ndarray,
        amplitude: Float[ArrayLike, "..."],
        phase: Float[ArrayLike, "..."],
        *,
        start_time: Float[ArrayLike, ""] = 0.0,
        start_position: Float[ArrayLike, ""] = 0.0,
    ):
        """A sum of cosines.

        Args:
            base_frequency: base frequency [Hz].
            lines: multiples of it, increasing, from 1.
            amplitude: amplitude of the velocity at each line, or one for all [m/s or rad/s].
            phase: phase at each line, or one for all [rad].
            start_time: time to which the phases belong [s].
            start_position: position at that time [m or rad].
        """
        self.lines = _whole(lines)
        self.base_frequency = as_scalar(base_frequency)
        self.amplitude = _each("amplitude", amplitude, len(self.lines))
        self.phase = _each("phase", phase, len(self.lines))
        self.start_time = as_scalar(start_time)
        self.start_position = as_scalar(start_position)

    def __check_init__(self):
        positive("base_frequency", self.base_frequency, "Hz")
        finite("amplitude", self.amplitude, "m/s")
        finite("phase", self.phase, "rad")
        finite("start_time", self.start_time, "s")
        finite("start_position", self.start_position, "m")

    @staticmethod
    def schroeder(
        base_frequency: Float[ArrayLike, ""],
        lines: Sequence[int] | np.ndarray,
        rms: Float[ArrayLike, ""],
        *,
        start_time: Float[ArrayLike, ""] = 0.0,
        start_position: Float[ArrayLike, ""] = 0.0,
    ) -> "Multisine":
        """Equal amplitudes with Schroeder's phases φ_k = -π·k·(k - 1)/N, k = 1...N, whose peaks are low.

        Args:
            base_frequency: base frequency [Hz].
            lines: multiples of it, increasing, from 1.
            rms: root mean square of the velocity over a period [m/s or rad/s].
            start_time: time to which the phases belong [s].
            start_position: position at that time [m or rad].

        Source: M. R. Schroeder, "Synthesis of low-peak-factor signals and binary sequences with low autocorrelation",
        IEEE Trans. Inf. Theory 16 (1970) 85-89.
        """
        k = np.arange(1, len(lines) + 1)
        phase = -np.pi * (k * (k - 1) % (2 * max(len(lines), 1))) / max(len(lines), 1)
        amplitude = _equal_amplitude(rms, len(lines))
        return Multisine(base_frequency, lines, amplitude, phase, start_time=start_time, start_position=start_position)

    @staticmethod
    def random_phase(
        base_frequency: Float[ArrayLike, ""],
        lines: Sequence[int] | np.ndarray,
        rms: Float[ArrayLike, ""],
        seed: int,
        *,
        start_time: Float[ArrayLike, ""] = 0.0,
        start_position: Float[ArrayLike, ""] = 0.0,
    ) -> "Multisine":
        """Equal amplitudes with independent phases, evenly distributed; several seeds average nonlinearities out.

        Args:
            base_frequency: base frequency [Hz].
            lines: multiples of it, increasing, from 1.
            rms: root mean square of the velocity over a period [m/s or rad/s].
            seed: of the phases; the same seed gives the same phases.
            start_time: time to which the phases belong [s].
            start_position: position at that time [m or rad].
        """
        phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(lines))
        amplitude = _equal_amplitude(rms, len(lines))
        return Multisine(base_frequency, lines, amplitude, phase, start_time=start_time, start_position=start_position)

    def __call__(self, t: Float[ArrayLike, ""]) -> MotionPoint:
        omega = 2 * jnp.pi * self.frequencies()
        angle = omega * (t - self.start_time) + self.phase
        sine, cosine = jnp.sin(angle), jnp.cos(angle)
        return MotionPoint(
            self.start_position + jnp.sum(self.amplitude / omega * (sine - jnp.sin(self.phase))),
            jnp.sum(self.amplitude * cosine),
            -jnp.sum(self.amplitude * omega * sine),
        )

    def frequencies(self) -> Float[Array, " lines"]:
        """Frequencies f_k of the lines, shape (lines,) [Hz]."""
        return self.base_frequency * jnp.asarray(self.lines, dtype=jnp.float64)

    def period(self) -> Float[Array, ""]:
        """Time after which it repeats [s]."""
        return 1 / self.base_frequency

    def check_sampled(self, sample_rate: float) -> None:
        """Raise unless every line lies below half of a sample rate [Hz].

        Raises:
            InputError: if a line reaches half the sample rate.
        """
        if is_concrete(self.base_frequency):
            check_below_nyquist("the multisine", self.frequencies()[-1], sample_rate)

    def switching_times(self) -> Float[Array, "0"]:
        """None: it is smooth at all times."""
        return jnp.zeros(0)


def _equal_amplitude(rms: Float[ArrayLike, ""], count: int) -> Float[Array, ""]:
    positive("rms", rms, "m/s")
    return as_scalar(rms) * np.sqrt(2 / max(count, 1))


def _whole(lines: Sequence[int] | np.ndarray) -> tuple[int, ...]:
    numbers = np.asarray(lines, dtype=np.float64)
    if numbers.ndim != 1 or numbers.size == 0:
        raise InputError(
            f"lines must be a vector of whole numbers, but has the shape {numbers.shape}. Give some lines."
        )
    wrong = np.flatnonzero(~((numbers >= 1) & (numbers == np.round(numbers)) & np.isfinite(numbers)))
    if wrong.size:
        raise InputError(
            f"lines must be whole multiples of the base frequency, from 1, but lines[{wrong[0]}] is "
            f"{numbers[wrong[0]]:g}. Divide the frequencies wanted by the base frequency and round."
        )
    if np.any(np.diff(numbers) <= 0):
        raise InputError("lines must increase strictly, but do not. Sort them and drop repeated ones.")
    return tuple(int(n) for n in numbers)


def _each(name: str, value: Float[ArrayLike, "..."], count: int) -> Float[Array, " lines"]:
    array = as_array(value)
    if array.shape not in ((), (1,), (count,)):
        raise InputError(f"{name} has shape {array.shape}, but there are {count} lines. Give one value for each line.")
    return jnp.broadcast_to(array, (count,))
