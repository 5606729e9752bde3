"""MACXP between the modes of a model and those of a reference, at the outputs measured."""

import numpy as np
from jaxtyping import Array, Float

from twin._checks import InputError, is_concrete, require_x64
from twin.correlation.modal_parameters import marked_eigenvalue
from twin.correlation.shapes import marked_macxp
from twin.modal.damped import DampedModes
from twin.modal.reference import ReferenceModes, output_rows
from twin.modal.undamped import Modes

_DAMPING = ("reference", "own")


def macxp_of_modes(
    modes: Modes | DampedModes | ReferenceModes,
    reference: Modes | DampedModes | ReferenceModes,
    *,
    outputs: tuple[str, ...] | None = None,
    damping: str = "reference",
) -> Float[Array, "modes references"]:
    """MACXP of every mode with every reference mode; differentiable, for `jit` and `vmap`.

    Args:
        modes: simulated modes.
        reference: reference modes.
        outputs: names of the rows compared; all of the reference's if not given.
        damping: "reference" gives both modes of a pair the reference's damping ratio, so that damping has no part in
            it (assumption A1 of the paper); "own" gives each its own.

    Returns:
        MACXP; NaN for a rigid-body mode, for one without a frequency (of an unstable model), and for a shape that is
        zero at these outputs. They leave the derivatives of the others alone, but for an unstable model's.

    Raises:
        InputError: 64-bit mode off, an output that is not in both, a mode that vibrates without damping, a damping
            option that there is not.

    Source: eq. 4 of J. Ellinger, M. F. Zaeh, Machines 10 (2022) 535.
    """
    require_x64()
    if damping not in _DAMPING:
        raise InputError(f"damping must be one of {', '.join(_DAMPING)}, but is {damping!r}.")
    names = reference.outputs if outputs is None else outputs
    rows, rows_ref = np.array(output_rows(modes, names)), np.array(output_rows(reference, names))
    _damped("reference", reference)
    ratio = reference.damping_ratio[None, :]
    if damping == "own":
        _damped("modes", modes)
        ratio = modes.damping_ratio[:, None]
    return marked_macxp(
        modes.output_shapes[rows],
        marked_eigenvalue(modes.frequency[:, None], ratio),
        reference.output_shapes[rows_ref],
        marked_eigenvalue(reference.frequency, reference.damping_ratio)[None, :],
    )


def _damped(name: str, modes: Modes | DampedModes | ReferenceModes) -> None:
    if not is_concrete(modes.frequency) or not is_concrete(modes.damping_ratio):
        return
    frequency, ratio = np.asarray(modes.frequency), np.asarray(modes.damping_ratio)
    bare = np.flatnonzero((frequency > 0) & (ratio <= 0))
    if bare.size:
        raise InputError(
            f"{name} has {bare.size} modes that vibrate without damping (first mode {bare[0]}, "
            f"{frequency[bare[0]]:g} Hz, damping ratio {ratio[bare[0]]:g}): MACXP is singular there. Give the model "
            "material damping, or the measured modes their damping ratios."
        )
