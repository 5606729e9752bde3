"""Reference modes at the axis positions of a study, checked, and how alike modes of a machine are to them."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from fitting.identification.machine_macxp import macxp_of_one_ratio
from twin._checks import InputError
from twin.modal.reference import ReferenceModes


@dataclasses.dataclass(frozen=True)
class Evidence:
    """The reference modes at one position."""

    position: float
    """Axis position [m]."""
    omega: Float[np.ndarray, "references"]
    """Angular natural frequencies [rad/s]."""
    ratio: Float[np.ndarray, "references"]
    """Damping ratios [-]."""
    shapes: Float[np.ndarray, "outputs references"]
    """Shapes of unit length."""
    outputs: tuple[str, ...]
    """Names "node direction" of the outputs."""

    @property
    def labels(self) -> tuple[str, ...]:
        """Name of each reference mode: "mode 8 at +135 mm", counted from 1."""
        return tuple(f"mode {i + 1} at {1e3 * self.position:+.0f} mm" for i in range(self.omega.size))

    def only(self, mode: int) -> "Evidence":
        """One of the reference modes.

        Args:
            mode: its number, from 0.
        """
        kept = slice(mode, mode + 1)
        return Evidence(self.position, self.omega[kept], self.ratio[kept], self.shapes[:, kept], self.outputs)

    def alike(
        self,
        eigenvalues: Float[np.ndarray, "samples n"],
        shapes: Float[np.ndarray, "samples n n"],
        output_map: Float[np.ndarray, "outputs n"],
    ) -> Float[np.ndarray, "samples n references"]:
        """MACXP of all modes of many samples with the reference modes, damped as these are (assumption A1).

        Args:
            eigenvalues: ω² [1/s²]; MACXP is zero where it is not positive.
            shapes: shapes in the machine's coordinates, one mode per column.
            output_map: motion of each output per coordinate.
        """
        moved = output_map @ shapes
        length = np.sum(moved**2, axis=1)
        cross = np.swapaxes(moved, 1, 2) @ self.shapes
        mac = cross**2 / np.where(length > 0, length, 1.0)[..., None]
        omega = np.sqrt(np.maximum(eigenvalues, 0.0))
        return macxp_of_one_ratio(mac, omega[..., None], self.omega, self.ratio)


def evidence(references: Sequence[ReferenceModes], positions: Sequence[float]) -> tuple[Evidence, ...]:
    """Reference modes made ready for comparison, one set for each position.

    Args:
        references: measured modes; a mode that was not found is left out, so that their number may differ.
        positions: axis positions [m].

    Raises:
        InputError: another number of positions, or one twice, different outputs, complex shapes, a reference mode
            without frequency, damping or shape.
    """
    if len(references) != len(positions) or not references:
        raise InputError(
            f"There are {len(references)} sets of reference modes for {len(positions)} positions. Give one each."
        )
    require_distinct(positions)
    return tuple(_one(modes, float(z), references[0].outputs) for modes, z in zip(references, positions, strict=True))


def require_distinct(positions: Sequence[float]) -> None:
    """Raise unless all positions lie on different millimetres.

    Args:
        positions: axis positions [m].

    Raises:
        InputError: two that do not.
    """
    if len({round(1e3 * float(z)) for z in positions}) < len(positions):
        raise InputError(f"positions {tuple(positions)} m name the same millimetre twice. Join their modes in one set.")


def _one(modes: ReferenceModes, position: float, outputs: tuple[str, ...]) -> Evidence:
    where = f"The reference modes at position {position:g} m"
    if modes.outputs != outputs:
        raise InputError(f"{where} have other outputs than those at the first. Reduce all by reference_modes.")
    shapes = np.asarray(modes.output_shapes)
    if np.iscomplexobj(shapes):
        raise InputError(f"{where} are complex. Turn each by its phase and take the real part.")
    frequency, ratio, length = (
        np.asarray(modes.frequency),
        np.asarray(modes.damping_ratio),
        np.linalg.norm(shapes, axis=0),
    )
    bad = ~((frequency > 0) & (ratio > 0) & (ratio < 1) & (length > 0))  # NaN is bad, too
    if bad.any() or frequency.size == 0:
        i = int(np.argmax(bad)) if bad.size else -1
        what = f"mode {i + 1} has {frequency[i]:g} Hz and damping ratio {ratio[i]:g}" if bad.any() else "there is none"
        raise InputError(
            f"{where} must have a frequency, a shape that moves and a damping ratio between 0 and 1, but {what}. Leave "
            "a mode out that was not found."
        )
    return Evidence(position, 2 * np.pi * frequency, ratio, shapes / length, outputs)
