"""Free vibration modes of a round shaft along z: bending in two planes, axial, torsion.

For building component models offline: needs scikit-fem, the extra `finite-elements`.
"""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.linalg import eigh
from scipy.sparse import csc_matrix

from twin.structure.solid_modes import mass_normalised


class ShaftModes(NamedTuple):
    """Modes of a free shaft, mass-normalised, those of the rigid body first."""

    mesh: Float[np.ndarray, "points"]
    """Points along the shaft [m], ascending."""
    eigenvalues: Float[np.ndarray, "modes"]
    """ω² of each mode [1/s²]; zero for the six of the rigid body."""
    shapes: Float[np.ndarray, "points 6 modes"]
    """x, y, z, rx, ry, rz of each mode at these points."""

    def at(self, coordinate: float) -> Float[np.ndarray, "6 modes"]:
        """Motion of the mesh point nearest to a coordinate [m]."""
        return self.shapes[np.argmin(np.abs(self.mesh - coordinate))]


def shaft_modes(
    mesh: Float[np.ndarray, "points"],
    outer: Float[np.ndarray, "..."],
    bore: float,
    *,
    modulus: float,
    ratio: float,
    density: float,
    bending: int,
    axial: int,
    torsion: int,
) -> ShaftModes:
    """Modes of a free shaft of round section, by slender-beam elements with rotary inertia.

    Args:
        mesh: points along the shaft [m].
        outer: outer diameter of each piece between two points [m].
        bore: diameter of the bore [m].
        modulus: Young's modulus [N/m²].
        ratio: Poisson's ratio [-].
        density: density [kg/m³].
        bending: number of elastic bending modes in each plane.
        axial: number of elastic axial modes.
        torsion: number of elastic torsional modes.
    """
    import skfem
    from skfem.helpers import d, dot

    line = skfem.MeshLine(mesh)
    if not np.all(np.diff(line.p[0]) > 0):
        raise ValueError(f"mesh must ascend, but is {mesh}.")
    area = np.pi / 4 * (outer**2 - bore**2)
    second = np.pi / 64 * (outer**4 - bore**4)
    stretch = skfem.BilinearForm(lambda u, v, w: w.a * dot(d(u), d(v)))
    inertia = skfem.BilinearForm(lambda u, v, w: w.a * u * v)
    curvature = skfem.BilinearForm(lambda u, v, w: w.a * u.hess[0, 0] * v.hess[0, 0])

    bar = skfem.Basis(line, skfem.ElementLineP1())
    beam = skfem.Basis(line, skfem.ElementLineHermite(), intorder=6)
    shear = modulus / (2 * (1 + ratio))

    def matrix(form: Any, basis: Any, value: Any) -> Any:
        per_point = np.broadcast_to(value[:, None], (value.size, basis.X.shape[-1]))
        return csc_matrix(form.assemble(basis, a=per_point)).toarray()

    deflection = _free_modes(
        matrix(curvature, beam, modulus * second),
        matrix(inertia, beam, density * area) + matrix(stretch, beam, density * second),
        np.stack([np.tile([1.0, 0.0], mesh.size), np.stack([mesh, np.ones_like(mesh)], axis=1).ravel()], axis=1),
        bending,
    )
    along = _free_modes(
        matrix(stretch, bar, modulus * area), matrix(inertia, bar, density * area), np.ones((mesh.size, 1)), axial
    )
    twist = _free_modes(
        matrix(stretch, bar, 2 * shear * second),
        matrix(inertia, bar, 2 * density * second),
        np.ones((mesh.size, 1)),
        torsion,
    )
    shift, slope = deflection[1][0::2], deflection[1][1::2]
    families = (
        (deflection[0], {0: shift, 4: slope}, 2),
        (deflection[0], {1: shift, 3: -slope}, 2),
        (along[0], {2: along[1]}, 1),
        (twist[0], {5: twist[1]}, 1),
    )
    values, shapes, elastic = [], [], []
    for squared, rows, rigid in families:
        block = np.zeros((mesh.size, 6, squared.size))
        for row, shape in rows.items():
            block[:, row] = shape
        values.append(squared)
        shapes.append(block)
        elastic.append(np.arange(squared.size) >= rigid)
    order = np.argsort(np.concatenate(elastic), kind="stable")
    return ShaftModes(mesh, np.concatenate(values)[order], np.concatenate(shapes, axis=2)[..., order])


def _free_modes(stiffness: Any, mass: Any, rigid: Any, elastic: int) -> tuple[Any, Any]:
    """ω² and mass-normalised shapes of a free body: the given rigid motions, then the elastic ones."""
    rigid = mass_normalised(rigid, mass)
    kept = slice(rigid.shape[1], rigid.shape[1] + elastic)
    values, vectors = eigh(stiffness, mass)
    vectors = vectors[:, kept] - rigid @ (rigid.T @ (mass @ vectors[:, kept]))
    return np.r_[np.zeros(rigid.shape[1]), values[kept]], np.c_[rigid, mass_normalised(vectors, mass)]
