"""A machine at one position as a linear function of its unknown springs and dampers, and its modes at many samples."""

import dataclasses
from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from fitting.identification.machine_unknowns import VISCOUS, unknowns, without_unknowns
from twin._checks import InputError, require_x64
from twin.parameters import ParameterSpace
from twin.structure import Machine


@dataclasses.dataclass(frozen=True)
class AffineMachine:
    """K = K₀ + S·diag(k)·Sᵀ, and damping likewise, in coordinates in which the mass matrix is the identity."""

    fixed: Float[np.ndarray, "n n"]
    """Stiffness without the unknown springs K₀ [1/s²]."""
    springs: Float[np.ndarray, "n rows"]
    """Stretch of each place of the unknown springs S; four rows for a stiffness of four equal shoes."""
    spring_of: Int[np.ndarray, "rows"]
    """Number of the stiffness, among the unknown ones, that each row belongs to."""
    stiffness: Int[np.ndarray, "stiffnesses"]
    """Number in the space of each unknown stiffness."""
    viscous: Float[np.ndarray, "n n"]
    """Known viscous damping [1/s]."""
    hysteretic: Float[np.ndarray, "n n"]
    """Known hysteretic damping [1/s²]."""
    dampers: Float[np.ndarray, "n damper_rows"]
    """Stretch of each place of the unknown dampers."""
    damper_of: Int[np.ndarray, "damper_rows"]
    """Number of the damping, among the unknown ones, that each row belongs to."""
    damping: Int[np.ndarray, "dampings"]
    """Number in the space of each unknown damping."""
    is_viscous: Bool[np.ndarray, "dampings"]
    """Which of the unknown dampings are viscous."""
    output_map: Float[np.ndarray, "outputs n"]
    """Motion of each output per coordinate [1/√kg]."""

    def stiffness_matrices(self, values: Float[np.ndarray, "samples stiffnesses"]) -> Float[np.ndarray, "samples n n"]:
        """K at many samples, by one matrix product.

        Args:
            values: unknown stiffnesses k.
        """
        n = len(self.fixed)
        each = [self.springs[:, rows] @ self.springs[:, rows].T for rows in _rows_of(self.spring_of, self.stiffness)]
        return self.fixed + (values @ np.reshape(each, (-1, n * n))).reshape(-1, n, n)

    def damping_ratios(
        self, omega: Float[np.ndarray, "samples modes"], shapes: Float[np.ndarray, "samples n modes"]
    ) -> tuple[Float[np.ndarray, "samples modes"], Float[np.ndarray, "samples modes dampings"]]:
        """Damping ratios without the unknown dampers, and what each of these adds per unit: ζ = ζ_known + Q·p, eq. 12.

        Args:
            omega: angular natural frequencies [rad/s], above zero.
            shapes: unit shapes in these coordinates.
        """
        rows = np.swapaxes(shapes, 1, 2)
        known = np.sum((rows @ self.viscous) * rows, axis=2) / (2 * omega)
        known += np.sum((rows @ self.hysteretic) * rows, axis=2) / (2 * omega**2)
        strokes = (rows @ self.dampers) ** 2 @ (self.damper_of[:, None] == np.arange(self.damping.size))
        scale = np.where(self.is_viscous, 1 / (2 * omega[..., None]), 1 / (2 * omega[..., None] ** 2))
        return known, strokes * scale


def affine_machine(machine: Machine, space: ParameterSpace, position: float, outputs: Sequence[str]) -> AffineMachine:
    """The matrices of a machine at a position, taken apart by its unknown springs and dampers.

    Args:
        machine: machine; its values of the unknown parameters play no part.
        space: unknown stiffnesses and dampings of joints.
        position: axis position [m].
        outputs: names "node direction" of what is measured.

    Raises:
        InputError: 64-bit mode off, a parameter that is no stiffness or damping of a joint, an unknown output, a
            position off the rail.
    """
    require_x64()
    kinds = unknowns(space)
    rest = without_unknowns(machine, space)
    system = rest.second_order(position, inputs=(), outputs=tuple(outputs))
    connections = rest.connections(position)
    lower = np.linalg.cholesky(np.asarray(system.mass))
    vectors = np.linalg.solve(lower, np.asarray(connections.vectors))

    def reduced(matrix: jnp.ndarray) -> np.ndarray:
        half = np.linalg.solve(lower, np.asarray(matrix))
        whole = np.linalg.solve(lower, half.T)
        return (whole + whole.T) / 2

    def rows(numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        places, owners = [], []
        for owner, number in enumerate(numbers):
            name, direction = kinds.joint[number], kinds.direction[number]
            found = [i for i, row in enumerate(connections.names) if row.rsplit(" ", 2)[::2] == [name, direction]]
            if not found:
                raise InputError(f"Joint {name!r} does not act in {direction!r}: {space.paths[number]!r} does nothing.")
            places += found
            owners += [owner] * len(found)
        return vectors[:, np.asarray(places, dtype=int)], np.asarray(owners, dtype=int)

    springs, spring_of = rows(kinds.stiffness)
    dampers, damper_of = rows(kinds.damping)
    return AffineMachine(
        reduced(system.stiffness),
        springs,
        spring_of,
        kinds.stiffness,
        reduced(system.viscous),
        reduced(system.hysteretic),
        dampers,
        damper_of,
        kinds.damping,
        kinds.kind[kinds.damping] == VISCOUS,
        np.linalg.solve(lower, np.asarray(system.output_map).T).T,
    )


def _rows_of(owner: np.ndarray, owners: np.ndarray) -> list[np.ndarray]:
    return [np.flatnonzero(owner == i) for i in range(len(owners))]
