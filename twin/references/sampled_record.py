"""A motion given by samples: a recorded set value, or one computed elsewhere."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, as_array, finite
from twin.references._sampling import (
    central_differences,
    check_shape,
    check_times,
    ends_or_samples,
    interval_of,
    is_uniform,
    part_of_interval,
)
from twin.references.reference import AbstractReference, MotionPoint


class SampledReference(AbstractReference):
    """A motion through samples of position; at a sample time it is exactly the sample.

    "cubic": the position is the cubic Hermite curve through the samples with the sampled velocities as its slopes, the
    velocity is the exact derivative of this curve, the acceleration is interpolated linearly. "linear": each of the
    three is interpolated linearly on its own. Before and after the record the axis stands still at the first and the
    last position; a record that does not begin and end at rest therefore jumps in velocity there.
    """

    times: Float[Array, " samples"]
    """Sample times, strictly increasing, shape (samples,) [s]."""
    position: Float[Array, " samples"]
    """Positions at the samples, shape (samples,) [m or rad]."""
    velocity: Float[Array, " samples"]
    """Velocities at the samples, shape (samples,) [m/s or rad/s]."""
    acceleration: Float[Array, " samples"]
    """Accelerations at the samples, shape (samples,) [m/s² or rad/s²]."""
    interpolation: str = eqx.field(static=True)
    """What lies between two samples: "cubic" or "linear"."""
    switch_at_samples: bool = eqx.field(static=True)
    """Whether every sample is a switching time, or only the two ends of the record."""
    uniform: bool = eqx.field(static=True)
    """Whether the samples are evenly spaced, so that an index is computed instead of searched."""

    def __init__(
        self,
        times: Float[ArrayLike, " samples"],
        position: Float[ArrayLike, " positions"],
        velocity: Float[ArrayLike, " velocities"] | None = None,
        acceleration: Float[ArrayLike, " accelerations"] | None = None,
        *,
        interpolation: str = "cubic",
        switch_at_samples: bool = False,
    ):
        """A motion through samples.

        Args:
            times: sample times, strictly increasing, shape (samples,) [s].
            position: positions, shape (samples,) [m or rad].
            velocity: velocities, shape (samples,) [m/s or rad/s]; by central differences of the position if left out.
            acceleration: accelerations, shape (samples,) [m/s² or rad/s²]; by central differences of the velocity if
                left out.
            interpolation: "cubic" or "linear".
            switch_at_samples: tell the integrator of every sample. Worth it only where an adaptive integrator takes
                steps much shorter than the sampling period; with many samples it forces as many steps.

        Raises:
            InputError: if the times do not increase, lengths differ, an entry is not finite, or the interpolation has
                another name.
        """
        if interpolation not in ("linear", "cubic"):
            raise InputError(f'interpolation must be "linear" or "cubic", but is {interpolation!r}.')
        self.times = as_array(times)
        check_times(self.times)
        self.position = self._channel("position", position, "m")
        if velocity is None:
            self.velocity = central_differences(self.times, self.position)
        else:
            self.velocity = self._channel("velocity", velocity, "m/s")
        if acceleration is None:
            self.acceleration = central_differences(self.times, self.velocity)
        else:
            self.acceleration = self._channel("acceleration", acceleration, "m/s²")
        self.interpolation = interpolation
        self.switch_at_samples = switch_at_samples
        self.uniform = is_uniform(self.times)

    def _channel(self, name: str, value: ArrayLike, unit: str) -> Float[Array, " samples"]:
        samples = as_array(value)
        check_shape(name, samples, self.times.size)
        finite(name, samples, unit)
        return samples

    def __call__(self, t: Float[ArrayLike, ""]) -> MotionPoint:
        t = jnp.asarray(t)
        i = interval_of(self.times, t, self.uniform)
        step = self.times[i + 1] - self.times[i]
        s = part_of_interval(self.times, t, i)
        p0, p1 = self.position[i], self.position[i + 1]
        v0, v1 = self.velocity[i], self.velocity[i + 1]
        if self.interpolation == "cubic":
            position = (
                (1 + 2 * s) * (1 - s) ** 2 * p0 + s**2 * (3 - 2 * s) * p1 + s * (1 - s) * step * ((1 - s) * v0 - s * v1)
            )
            velocity = 6 * s * (1 - s) * (p1 - p0) / step + (1 - s) * (1 - 3 * s) * v0 + s * (3 * s - 2) * v1
        else:
            position = (1 - s) * p0 + s * p1
            velocity = (1 - s) * v0 + s * v1
        acceleration = (1 - s) * self.acceleration[i] + s * self.acceleration[i + 1]
        outside = (t < self.times[0]) | (t > self.times[-1])
        return MotionPoint(position, jnp.where(outside, 0.0, velocity), jnp.where(outside, 0.0, acceleration))

    def switching_times(self) -> Float[Array, " switches"]:
        return ends_or_samples(self.times, self.switch_at_samples)
