"""Modes as a measurement gives them: known at the measured rows only."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Inexact

from twin._checks import InputError, as_array, finite, not_negative, require_x64
from twin.modal.damped import DampedModes
from twin.modal.undamped import Modes


def _as_shapes(value: Any) -> Inexact[Array, "outputs modes"]:
    require_x64()
    if not hasattr(value, "dtype") and not isinstance(value, list | tuple):
        return value  # a placeholder put there by a tree transformation
    array = jnp.asarray(value)
    return array if jnp.iscomplexobj(array) else as_array(array)


class ReferenceModes(eqx.Module):
    """Natural frequencies, damping ratios and shapes at measured rows, as modal analysis of a machine gives them.

    A mode that was not found is left out.
    """

    frequency: Float[Array, "modes"] = eqx.field(converter=as_array)
    """Natural frequencies [Hz]."""
    damping_ratio: Float[Array, "modes"] = eqx.field(converter=as_array)
    """Damping ratios ζ [-]."""
    output_shapes: Inexact[Array, "outputs modes"] = eqx.field(converter=_as_shapes)
    """Shapes at the outputs, one mode per column, real or complex, at any scale."""
    outputs: tuple[str, ...] = eqx.field(static=True)
    """Names of the rows."""

    def __check_init__(self):
        not_negative("frequency", self.frequency, "Hz")
        finite("damping_ratio", self.damping_ratio, "-")
        if not all(hasattr(x, "shape") for x in (self.frequency, self.damping_ratio, self.output_shapes)):
            return
        finite("output_shapes", self.output_shapes)
        modes = self.frequency.shape[-1]
        if self.damping_ratio.shape[-1] != modes or self.output_shapes.shape[-2:] != (len(self.outputs), modes):
            raise InputError(
                f"{modes} frequencies go with {modes} damping ratios and shapes ({len(self.outputs)}, {modes}), one "
                f"row for each name in outputs, but there are {self.damping_ratio.shape[-1]} damping ratios and shapes "
                f"{self.output_shapes.shape}."
            )


def reference_modes(
    modes: Modes | DampedModes | ReferenceModes,
    *,
    outputs: tuple[str, ...] | None = None,
    indices: tuple[int, ...] | None = None,
) -> ReferenceModes:
    """Some of the modes at some of the outputs, as a measurement there would give them.

    Args:
        modes: modes of a model, or measured ones.
        outputs: names of the rows wanted, in the order wanted; all if not given.
        indices: modes wanted; all if not given.

    Returns:
        The modes.

    Raises:
        InputError: an output or a mode that is not there.
    """
    rows = np.array(output_rows(modes, modes.outputs if outputs is None else outputs))
    number = modes.frequency.shape[-1]
    chosen = range(number) if indices is None else indices
    for i in chosen:
        if not 0 <= i < number:
            raise InputError(f"There is no mode {i}: there are {number}, counted from 0. Ask for fewer modes.")
    kept = np.asarray(chosen, dtype=int)
    names = tuple(modes.outputs[i] for i in rows)
    return ReferenceModes(
        modes.frequency[kept], modes.damping_ratio[kept], modes.output_shapes[rows[:, None], kept], names
    )


def output_rows(modes: Modes | DampedModes | ReferenceModes, names: tuple[str, ...]) -> list[int]:
    """Where the outputs of some names are among the rows of the shapes.

    Args:
        modes: modes.
        names: names of outputs.

    Returns:
        Index of each.

    Raises:
        InputError: no name at all, one that the modes do not have, or that they have more than once.
    """
    if not names:
        raise InputError("outputs is empty. Name the rows at which shapes are compared.")
    for name in names:
        if modes.outputs.count(name) != 1:
            what = "no" if name not in modes.outputs else "more than one"
            raise InputError(f"The modes have {what} output {name!r}; they have {', '.join(modes.outputs)}.")
    return [modes.outputs.index(name) for name in names]
