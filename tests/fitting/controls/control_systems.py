"""Small systems for controls: one that explains its data, one that cannot, one that explains any data."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.residuals.frequency_response import FrequencyResponseResidual
from fitting.residuals.trajectory import TrajectoryResidual
from twin._checks import as_array, as_scalar
from twin.frf import FRF
from twin.parameters import Parameter, ParameterSpace
from twin.plant import AbstractPlant
from twin.record import Record
from twin.references import AbstractReference
from twin.stepping import ConstantSteps

STEPPING = ConstantSteps(2)
NOISE = 0.05
TIMES = np.arange(400) * 0.01


class Command(NamedTuple):
    command: Array


class Speed(NamedTuple):
    speed: Array


class Wave(AbstractReference):
    """Sines of many frequencies that grow over time."""

    growth: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)

    def __call__(self, t):
        tones = sum(jnp.sin(2 * jnp.pi * f * t + f**2) for f in (0.7, 1.3, 2.9, 5.3))
        return Command((1 + self.growth * t) * tones)

    def switching_times(self):
        return jnp.zeros(0)


class Lag(AbstractPlant):
    """Speed behind its command, with a bend that large commands show."""

    gain: Float[Array, ""] = eqx.field(converter=as_scalar)
    time_constant: Float[Array, ""] = eqx.field(converter=as_scalar)
    bend: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)

    def initial_state(self):
        return jnp.zeros(())

    def rest_inputs(self):
        return Command(jnp.zeros(()))

    def vector_field(self, t, state, inputs):
        return (self.gain * inputs.command - state - self.bend * state**3) / self.time_constant

    def outputs(self, t, state, inputs):
        return Speed(state)


class AnyCurve(AbstractPlant):
    """A curve through free points over time: it explains whatever was measured, and knows no command."""

    heights: Float[Array, "points"] = eqx.field(converter=as_array)

    def initial_state(self):
        return jnp.zeros(())

    def rest_inputs(self):
        return Command(jnp.zeros(()))

    def vector_field(self, t, state, inputs):
        return jnp.zeros(())

    def outputs(self, t, state, inputs):
        return Speed(jnp.interp(t, jnp.linspace(0.0, 4.0, self.heights.size), self.heights))


SPACE = ParameterSpace([Parameter("gain", "1", 0.1, 10.0), Parameter("time_constant", "s", 1e-3, 1.0, scale="log")])
START = Lag(1.0, 0.3)


def record_of(plant, reference=None, *, seed=1, noise=NOISE, name="record"):
    """A record with noise, and the evidence from it."""
    from twin.simulation import simulate

    reference = Wave() if reference is None else reference
    clean = eqx.filter_jit(simulate)(plant, reference, TIMES, stepping=STEPPING).channel("speed")
    samples = np.asarray(clean) + noise * np.random.default_rng(seed).standard_normal(TIMES.size)
    record = Record.create(TIMES, {"speed": samples}, {"speed": "m/s"}, name=name)
    return record, TrajectoryResidual.create(record, reference, {"speed": noise}, stepping=STEPPING)


class Resonance(eqx.Module):
    """One mode."""

    frequency: jax.Array = eqx.field(converter=as_array)
    damping: jax.Array = eqx.field(converter=as_array)


MODE_SPACE = ParameterSpace(
    [Parameter("frequency", "Hz", 10.0, 100.0, scale="log"), Parameter("damping", "1", 1e-3, 1.0, scale="log")]
)


def respond(model, frequency):
    """1/(1 - η² + 2jDη)."""
    ratio = frequency / model.frequency
    values = 1 / (1 - ratio**2 + 2j * model.damping * ratio)
    return FRF(frequency, values[None, None], ("deflection",), ("force",))


def response_of(model, *, seed=2, relative=0.02):
    """A noisy response, and the evidence from it."""
    exact = respond(model, jnp.linspace(5.0, 120.0, 90))
    draw = np.random.default_rng(seed).standard_normal((2, *exact.values.shape)) / np.sqrt(2)
    sd = relative * np.abs(np.asarray(exact.values))
    noisy = FRF(
        exact.frequency,
        exact.values + sd * (draw[0] + 1j * draw[1]),
        exact.outputs,
        exact.inputs,
        variance=jnp.asarray(sd**2),
    )
    return noisy, FrequencyResponseResidual(noisy, respond=respond)
