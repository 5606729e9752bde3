"""Numbers that a study asks of a model: "max(position)", "rms_error(position)", "frequency(1)".

Of a simulated channel: max, min, mean, rms, last, range; of its error against the reference: max_error, rms_error,
last_error. Of the model's modes, the rigid body left out: frequency(n), damping(n).
"""

import re
from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from fitting.study.model_modes import elastic_modes
from twin._checks import InputError
from twin.io.toml_document import unknown
from twin.references import AbstractReference
from twin.simulation import simulate
from twin.stepping import AbstractStepping

_OF_CHANNEL: dict[str, Callable[[Array], Array]] = {
    "max": jnp.max,
    "min": jnp.min,
    "mean": jnp.mean,
    "rms": lambda x: jnp.sqrt(jnp.mean(x**2)),
    "last": lambda x: x[-1],
    "range": lambda x: jnp.max(x) - jnp.min(x),
}
_OF_ERROR = {
    "max_error": lambda x: jnp.max(jnp.abs(x)),
    "rms_error": _OF_CHANNEL["rms"],
    "last_error": lambda x: x[-1],
}
_OF_MODES = ("frequency", "damping")
KNOWN = (*_OF_CHANNEL, *_OF_ERROR, *_OF_MODES)
"""What can be asked."""


class AskedOutputs(eqx.Module):
    """Called with a model, the numbers asked, by their names. NaN where the simulation fails."""

    asked: tuple[tuple[str, str], ...] = eqx.field(static=True)
    """Pairs of what is asked and of what, such as ("max", "position")."""
    reference: AbstractReference | None = None
    """What drives the model; None where nothing is simulated."""
    times: Float[Array, "times"] | None = None
    """Times of the simulation [s]."""
    stepping: AbstractStepping | None = None
    """How time is stepped."""

    @property
    def simulates(self) -> bool:
        """Whether anything asked needs a simulation."""
        return any(what not in _OF_MODES for what, _ in self.asked)

    def __call__(self, model: Any) -> dict[str, Array]:
        """The numbers.

        Args:
            model: the model.
        """
        found: dict[str, Array] = {}
        trajectory: Any = None
        reference: Any = None
        if self.simulates:
            assert self.reference is not None and self.times is not None
            trajectory = simulate(model, self.reference, self.times, stepping=self.stepping)
            reference = jax.vmap(self.reference)(self.times)
        modes = elastic_modes(model) if any(what in _OF_MODES for what, _ in self.asked) else None
        for what, of in self.asked:
            name = f"{what}({of})"
            if what in _OF_MODES:
                assert modes is not None
                values = modes.frequency if what == "frequency" else modes.damping_ratio
                number = int(of) - 1
                found[name] = values[number] if number < values.size else jnp.asarray(jnp.nan)
            elif what in _OF_CHANNEL:
                found[name] = _OF_CHANNEL[what](trajectory.channel(of))
            else:
                found[name] = _OF_ERROR[what](getattr(reference, of) - trajectory.channel(of))
        return found


def parse_outputs(
    written: Sequence[str], channels: Sequence[str], references: Sequence[str]
) -> tuple[tuple[str, str], ...]:
    """Read what is asked.

    Args:
        written: texts such as "max(position)".
        channels: outputs of the model.
        references: channels that the reference gives as well, so that they have an error.

    Returns:
        Pairs of what is asked and of what.

    Raises:
        InputError: anything that cannot be asked.
    """
    found = []
    for one in written:
        match = re.fullmatch(r"\s*(\w+)\s*\(\s*([\w.]+)\s*\)\s*", one)
        if not match or match.group(1) not in KNOWN:
            name = match.group(1) if match else one
            raise InputError(f'{unknown("output", name, KNOWN)} Write them like "max(position)" or "frequency(1)".')
        what, of = match.groups()
        if what in _OF_MODES and not (of.isdigit() and int(of) >= 1):
            raise InputError(f'{one!r}: modes are counted from 1, as in "{what}(1)".')
        if what in _OF_CHANNEL and of not in channels:
            raise InputError(f"{one!r}: {unknown('channel', of, channels)}")
        if what in _OF_ERROR and of not in (set(channels) & set(references)):
            raise InputError(
                f"{one!r}: {unknown('channel with a reference', of, sorted(set(channels) & set(references)))}"
            )
        found.append((what, of))
    return tuple(found)
