"""A sine of velocity whose frequency sweeps, to excite a drive over a band."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, as_scalar, finite, is_concrete, not_negative, positive
from twin.references._chirp_integrals import linear_pair, logarithmic_pair, relative_expm1
from twin.references._sampling import check_below_nyquist
from twin.references.reference import AbstractReference, MotionPoint


class SineSweep(AbstractReference):
    """A velocity A·sin(phase(t)) whose frequency runs from one value to another, with its exact position.

    "linear": the frequency changes by the same number of hertz each second; "logarithmic": by the same factor. It may
    rise, fall or stay. With the frequency rate k or growth c, f₀ at the start and the time τ since then,

        linear       f = f₀ + k·τ          phase = 2π·(f₀ + f)/2·τ
        logarithmic  f = f₀·exp(c·τ)       phase = 2π·(f - f₀)/c

    Position is the integral of the velocity in closed form (Fresnel integrals, or sine and cosine integrals),
    acceleration its derivative. Before the sweep the axis stands at its start position. At its end the sine breaks off:
    the velocity jumps to zero by at most A, and the position stays.

    A machine is excited while it moves, as friction at standstill would hide its dynamics. Put the sweep on a motion:
    `SumReference((ConstantVelocity(...), SineSweep(...)))`; with a velocity above A the axis never turns back.

    Raises:
        InputError: if duration or a frequency is out of range, a value is not finite, or the kind has another name.
    """

    start_frequency: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Frequency f₀ at the start [Hz]; above zero for a logarithmic sweep."""
    end_frequency: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Frequency f₁ at the end [Hz]; above zero for a logarithmic sweep."""
    duration: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Duration T of the sweep [s]."""
    amplitude: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Amplitude A of the velocity, of either sign [m/s or rad/s]."""
    start_time: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Time at which the sweep begins [s]."""
    start_position: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Position before the sweep [m or rad]; zero where the sweep is added to another motion."""
    kind: str = eqx.field(static=True, default="linear")
    """How the frequency runs: "linear" or "logarithmic"."""

    def __check_init__(self):
        if self.kind not in ("linear", "logarithmic"):
            raise InputError(f'kind must be "linear" or "logarithmic", but is {self.kind!r}. Choose one of the two.')
        check_frequency = positive if self.kind == "logarithmic" else not_negative
        check_frequency("start_frequency", self.start_frequency, "Hz")
        check_frequency("end_frequency", self.end_frequency, "Hz")
        if is_concrete(self.start_frequency) and is_concrete(self.end_frequency):
            positive("the larger of start_frequency and end_frequency", self._highest(), "Hz")
        positive("duration", self.duration, "s")
        finite("amplitude", self.amplitude, "m/s")
        finite("start_time", self.start_time, "s")
        finite("start_position", self.start_position, "m")

    def __call__(self, t: Float[ArrayLike, ""]) -> MotionPoint:
        elapsed = t - self.start_time
        running = (elapsed >= 0) & (elapsed < self.duration)
        since_start = jnp.where(elapsed < 0, 0.0, jnp.where(running, elapsed, self.duration))
        frequency, phase = self._frequency_and_phase(since_start)
        sine, cosine = jnp.sin(phase), jnp.cos(phase)
        pair = logarithmic_pair if self.kind == "logarithmic" else linear_pair
        at_start, _ = pair(self.start_frequency, self._rate())
        f, g = pair(frequency, self._rate())
        travel = at_start - f * cosine - g * sine
        return MotionPoint(
            self.start_position + self.amplitude * travel,
            jnp.where(running, self.amplitude * sine, 0.0),
            jnp.where(running, self.amplitude * 2 * jnp.pi * frequency * cosine, 0.0),
        )

    def frequency(self, t: Float[ArrayLike, ""]) -> Float[Array, ""]:
        """Instantaneous frequency at a time [Hz]; before and after the sweep that of its start and its end."""
        elapsed = t - self.start_time
        held = jnp.where(elapsed < 0, 0.0, jnp.where(elapsed > self.duration, self.duration, elapsed))
        return self._frequency_and_phase(held)[0]

    def check_sampled(self, sample_rate: float) -> None:
        """Raise unless every frequency of the sweep lies below half of a sample rate [Hz].

        Raises:
            InputError: if the sweep reaches half the sample rate.
        """
        if is_concrete(self.start_frequency) and is_concrete(self.end_frequency):
            check_below_nyquist("the sweep", self._highest(), sample_rate)

    def switching_times(self) -> Float[Array, "2"]:
        """Start and end of the sweep [s]."""
        return jnp.stack([self.start_time, self.start_time + self.duration])

    def _highest(self) -> Float[Array, ""]:
        return jnp.maximum(self.start_frequency, self.end_frequency)

    def _rate(self) -> Float[Array, ""]:
        """Rate k [Hz/s] of a linear sweep, growth c [1/s] of a logarithmic one."""
        if self.kind == "logarithmic":
            return jnp.log(self.end_frequency / self.start_frequency) / self.duration
        return (self.end_frequency - self.start_frequency) / self.duration

    def _frequency_and_phase(self, elapsed: Float[Array, ""]) -> tuple[Array, Array]:
        if self.kind == "logarithmic":
            exponent = self._rate() * elapsed
            cycles = self.start_frequency * elapsed * relative_expm1(exponent)
            return self.start_frequency * jnp.exp(exponent), 2 * jnp.pi * cycles
        part = elapsed / self.duration
        frequency = self.start_frequency * (1 - part) + self.end_frequency * part
        return frequency, jnp.pi * (self.start_frequency + frequency) * elapsed
