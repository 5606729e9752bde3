"""Raw inputs given by samples: a recorded current, a process force, a command held between ticks."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float, PyTree

from twin._checks import InputError, as_array, finite
from twin.references._sampling import (
    check_shape,
    check_times,
    ends_or_samples,
    interval_of,
    is_uniform,
    part_of_interval,
)
from twin.references.reference import AbstractReference


class SampledSignal(AbstractReference):
    """Samples of a plant's inputs, in the structure of these inputs.

    "linear": straight between samples, and continuous. "hold": each sample is held until the next one (zero-order
    hold); the signal jumps at the samples, and all of them are switching times. Before and after the record the first
    and the last value are held. At a sample time the result is exactly the sample.
    """

    times: Float[Array, " samples"]
    """Sample times, strictly increasing, shape (samples,) [s]."""
    values: PyTree[Array]
    """NamedTuple, dictionary or any other tree of arrays, each of shape (samples, ...), in the plant's input units."""
    interpolation: str = eqx.field(static=True)
    """What lies between two samples: "linear" or "hold"."""
    switch_at_samples: bool = eqx.field(static=True)
    """Whether every sample is a switching time, or only the two ends of the record."""
    uniform: bool = eqx.field(static=True)
    """Whether the samples are evenly spaced, so that an index is computed instead of searched."""

    def __init__(
        self,
        times: Float[ArrayLike, " samples"],
        values: Any,
        *,
        interpolation: str = "linear",
        switch_at_samples: bool = False,
    ):
        """Samples of a plant's inputs.

        Args:
            times: sample times, strictly increasing, shape (samples,) [s].
            values: tree of arrays, each of shape (samples, ...), in the structure of the plant's inputs.
            interpolation: "linear" or "hold".
            switch_at_samples: tell the integrator of every sample also where the signal is only bent there. With many
                samples this forces as many steps. A held signal always does.

        Raises:
            InputError: if the times do not increase, a length differs, an entry is not finite, or the interpolation has
                another name.
        """
        if interpolation not in ("linear", "hold"):
            raise InputError(f'interpolation must be "linear" or "hold", but is {interpolation!r}.')
        self.times = as_array(times)
        check_times(self.times)
        self.values = jax.tree.map(as_array, values)
        for path, leaf in jax.tree_util.tree_leaves_with_path(self.values):
            name = f"values{jax.tree_util.keystr(path)}"
            check_shape(name, leaf, self.times.size)
            finite(name, leaf)
        self.interpolation = interpolation
        self.switch_at_samples = switch_at_samples or interpolation == "hold"
        self.uniform = is_uniform(self.times)

    def __call__(self, t: Float[ArrayLike, ""]) -> Any:
        t = jnp.asarray(t)
        i = interval_of(self.times, t, self.uniform)
        if self.interpolation == "hold":
            held = jnp.where(t >= self.times[-1], self.times.size - 1, i)
            return jax.tree.map(lambda samples: samples[held], self.values)
        s = part_of_interval(self.times, t, i)
        return jax.tree.map(lambda samples: (1 - s) * samples[i] + s * samples[i + 1], self.values)

    def switching_times(self) -> Float[Array, " switches"]:
        return ends_or_samples(self.times, self.switch_at_samples)
