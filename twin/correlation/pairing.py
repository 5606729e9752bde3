"""Simulated and reference modes that belong together."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool, Float, Inexact, Int

from twin._checks import InputError, is_concrete, require_x64
from twin.correlation.modes import macxp_of_modes
from twin.modal._assignment import best_first
from twin.modal.damped import DampedModes
from twin.modal.reference import ReferenceModes
from twin.modal.undamped import Modes


class PairedModes(eqx.Module):
    """Which mode belongs to each reference mode. A reference mode without one is marked, never given a guess."""

    order: Int[Array, "references"]
    """Index of the mode of each reference mode; -1 where it has none."""
    value: Float[Array, "references"]
    """Likeness of each pair [-]; where a reference mode has no mode, that of the best one left over, 0 if none was."""
    paired: Bool[Array, "references"]
    """Whether each reference mode has a mode."""

    def take(self, values: Inexact[Array, "... modes"]) -> Inexact[Array, "... references"]:
        """What belongs to the modes, in the order of the reference; NaN where it has no mode.

        Args:
            values: frequencies, damping ratios or shapes, modes on the last axis.
        """
        return jnp.where(self.paired, values[..., jnp.maximum(self.order, 0)], jnp.nan)


def assign(alike: Float[ArrayLike, "..."], *, threshold: float = 0.3) -> PairedModes:
    """Pair modes by any measure of likeness: the most alike pair first, each mode given away once.

    The choice is not differentiated; `value` is.

    Args:
        alike: likeness of each mode to each reference mode (modes, references), as `mac` and `macxp` give it; NaN where
            there is none.
        threshold: least value of a pair [-], between 0 and 1.

    Returns:
        The pairs.

    Raises:
        InputError: 64-bit mode off, not a matrix, a threshold outside 0 to 1.
    """
    require_x64()
    matrix = jnp.asarray(alike)
    if matrix.ndim != 2 or matrix.size == 0:
        raise InputError(f"alike must be a matrix (modes, references), but has shape {matrix.shape}.")
    if is_concrete(threshold) and not 0 <= threshold <= 1:
        raise InputError(f"threshold must be between 0 and 1 [-], but is {threshold:g}.")
    order = best_first(matrix.T)
    value = matrix[jnp.maximum(order, 0), jnp.arange(matrix.shape[1])]
    value = jnp.where((order >= 0) & ~jnp.isnan(value), value, 0.0)
    paired = (value >= threshold) & (value > 0)
    return PairedModes(jnp.where(paired, order, -1), value, paired)


def pair_modes(
    modes: Modes | DampedModes | ReferenceModes,
    reference: Modes | DampedModes | ReferenceModes,
    *,
    outputs: tuple[str, ...] | None = None,
    damping: str = "reference",
    threshold: float = 0.3,
) -> PairedModes:
    """Pair modes with those of a reference by MACXP, at the outputs measured.

    Each reference mode gets one mode, each mode is given away once, the most alike pair first: a mode that is very like
    one reference mode is not lost to another one that is a little like it. Reference modes may be missing, and there
    may be more modes than references or fewer. Rigid-body modes, which have no MACXP, are never paired.

    The default threshold is low, for what it stands for is a chance pairing: at 96 rows, unrelated real shapes reach a
    MAC of 0.11 once in a thousand, at 16 rows 0.3 once in fifty, before their frequencies are looked at. With the same
    shape it allows frequencies apart by about three times ζ. Take 0.5 to be sure with few rows, less for a model far
    from its reference, or `assign` by `mac`, which does not look at frequencies.

    The choice is not differentiated; `value` is. For `jit` and `vmap`.

    Args:
        modes: simulated modes.
        reference: modes to be found.
        outputs: names of the rows compared; all of the reference's if not given.
        damping: "reference" gives both modes of a pair the reference's damping ratio, so that damping has no part in
            it (assumption A1 of the paper); "own" gives each its own.
        threshold: least MACXP of a pair [-], between 0 and 1.

    Returns:
        The pairs, with their MACXP.

    Raises:
        InputError: 64-bit mode off, an output that is not in both, no reference mode with damping, a threshold outside
            0 to 1.

    Source: section 2.2 of J. Ellinger, M. F. Zaeh, Machines 10 (2022) 535.
    """
    alike = macxp_of_modes(modes, reference, outputs=outputs, damping=damping)
    return assign(alike, threshold=threshold)
