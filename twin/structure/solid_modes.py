"""Free vibration modes of a solid body of hexahedra, and how a patch of it moves as a rigid piece.

For building component models offline: needs scikit-fem, the extra `finite-elements`. The body is what is kept of a
grid of boxes; the elements are quadratic, so that one across a wall bends as the wall does.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import LinearOperator, eigsh, splu

SHIFT = 1e5
"""Shift of the eigenvalues [1/s²] that makes the stiffness of a free body invertible."""


class SolidModes(NamedTuple):
    """Modes of a free solid body, mass-normalised, the six of the rigid body first."""

    basis: Any
    """The finite-element basis of scikit-fem."""
    eigenvalues: Float[np.ndarray, "modes"]
    """ω² of each mode [1/s²]; zero for the six of the rigid body."""
    vectors: Float[np.ndarray, "dofs modes"]
    """Displacement of every degree of freedom [1/√kg]."""
    mass: float
    """Mass of the body [kg]."""

    def motion(
        self, centre: Float[np.ndarray, "3"], points: Float[np.ndarray, "points 3"]
    ) -> Float[np.ndarray, "6 modes"]:
        """Displacement and rotation of a rigid piece that follows points of the body best, in least squares.

        Args:
            centre: point of the rigid piece whose motion is wanted [m]; may lie outside the body.
            points: points of the body, at least three, not on one line [m].

        Returns:
            x, y, z, rx, ry, rz of every mode.
        """
        at_points = self.basis.probes(points.T) @ self.vectors
        return np.linalg.lstsq(rigid_motions((points - centre).T), at_points, rcond=None)[0]


def solid_modes(
    grid: tuple[Float[np.ndarray, "..."], ...],
    keep: Callable[[Float[np.ndarray, "3 boxes"]], Any],
    *,
    modulus: float,
    ratio: float,
    density: float,
    elastic: int,
) -> SolidModes:
    """Modes of the free body made of the boxes of a grid that are kept.

    Args:
        grid: planes between the boxes in x, y and z [m].
        keep: called with the centres of all boxes, (3, boxes) [m]; true where there is material.
        modulus: Young's modulus [N/m²].
        ratio: Poisson's ratio [-].
        density: density [kg/m³].
        elastic: number of elastic modes wanted.
    """
    import skfem
    from skfem.helpers import dot
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    mesh = skfem.MeshHex.init_tensor(*grid)
    mesh = mesh.restrict(np.flatnonzero(keep(mesh.p[:, mesh.t].mean(axis=1))))
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHexS2()), intorder=4)
    stiffness = csc_matrix(linear_elasticity(*lame_parameters(modulus, ratio)).assemble(basis))
    mass = density * csc_matrix(skfem.BilinearForm(lambda u, v, w: dot(u, v)).assemble(basis))

    rigid = np.zeros((basis.N, 6))
    for axis, dofs in enumerate(basis.split_indices()):
        rigid[dofs] = rigid_motions(basis.doflocs[:, dofs]).reshape(3, dofs.size, 6)[axis]
    rigid = mass_normalised(rigid, mass)
    start = np.sin(np.arange(1.0, basis.N + 1))  # any vector, always the same
    shifted = splu(csc_matrix(stiffness + SHIFT * mass), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    solve: Any = {"matvec": shifted.solve}
    inverse = LinearOperator(shape=mass.shape, dtype=np.dtype(np.float64), **solve)
    values, vectors = eigsh(stiffness, 6 + elastic, mass, sigma=-SHIFT, OPinv=inverse, v0=start)
    order = np.argsort(values)[6:]
    vectors = vectors[:, order]
    vectors = mass_normalised(vectors - rigid @ (rigid.T @ (mass @ vectors)), mass)
    total = np.ones(basis.split_indices()[0].size)
    first = basis.split_indices()[0]
    weight = float(total @ (mass[first][:, first] @ total))
    return SolidModes(basis, np.r_[np.zeros(6), values[order]], np.c_[rigid, vectors], weight)


def rigid_motions(place: Float[np.ndarray, "3 points"]) -> Float[np.ndarray, "rows 6"]:
    """Displacements of points, all x, then all y, then all z, under unit x, y, z, rx, ry, rz of a rigid body.

    Args:
        place: where the points are, from the centre of rotation [m].
    """
    x, y, z = place
    zero, one = np.zeros_like(x), np.ones_like(x)
    along_x = np.stack([one, zero, zero, zero, z, -y], axis=1)
    along_y = np.stack([zero, one, zero, -z, zero, x], axis=1)
    along_z = np.stack([zero, zero, one, y, -x, zero], axis=1)
    return np.concatenate([along_x, along_y, along_z])


def mass_normalised(vectors: Float[np.ndarray, "dofs vectors"], mass: Any) -> Float[np.ndarray, "dofs vectors"]:
    """The vectors made orthonormal in the mass matrix, each from itself and those before it."""
    lower = np.linalg.cholesky(vectors.T @ (mass @ vectors))
    return np.linalg.solve(lower, vectors.T).T
