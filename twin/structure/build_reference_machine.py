"""Builds the arrays of the reference machine: bed and table of solid finite elements, screw as a beam, two rotors.

Run once, offline: `python -m twin.structure.build_reference_machine`; needs the extra `finite-elements`. Every
dimension is chosen: a cast-iron bed of some two metres, unsymmetric on purpose, so that no two mounting elements do the
same in every mode. x is lateral, y vertical, z along the axis; the table is modelled at axis position zero.
"""

from importlib.resources import files
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from twin.structure.shaft_modes import shaft_modes
from twin.structure.solid_modes import SolidModes, rigid_motions, solid_modes

CAST_IRON = {"modulus": 9.0e10, "ratio": 0.26, "density": 7200.0}
"""Chosen: Young's modulus [N/m²], Poisson's ratio and density [kg/m³] of bed and table, of grey iron."""
STEEL = {"modulus": 2.1e11, "ratio": 0.3, "density": 7850.0}
"""Chosen: the same of the screw."""
SCREW_X, SCREW_Y = 0.035, 0.48
"""Chosen: where the screw's axis runs [m]."""
RAIL_X, RAIL_TOP = 0.30, 0.42
"""Chosen: lateral distance of the two guide rails from the middle and their height [m]."""
RAIL = np.linspace(-0.55, 0.60, 24)
"""Chosen: points of the guide rails along z at which shapes are stored [m]."""
SHOE_Z = 0.16
"""Chosen: distance of the guide shoes from the table's middle along the axis [m]."""
BED_FRONT = (-1.20, -1.166, -1.02, -0.86, -0.66, -0.62, -0.48, -0.34, -0.20, -0.16)
BED_BACK = (0.0, 0.14, 0.28, 0.32, 0.45, 0.58, 0.62, 0.76, 0.90, 1.06, 1.10)
"""Chosen: planes between the boxes of the bed in z [m]: front, where the z-motor is, and back."""
BED = (
    (-0.42, -0.39, -0.34, -0.26, -0.12, 0.0, 0.12, 0.26, 0.34, 0.375, 0.42),
    (0.0, 0.05, 0.15, 0.315, 0.36, 0.42, 0.60, 0.82),
    (*BED_FRONT, *BED_BACK),
)
"""Chosen: planes between the boxes of the bed in x, y, z [m]."""
TABLE = (
    (-0.38, -0.34, -0.26, -0.16, -0.02, 0.09, 0.20, 0.26, 0.34, 0.40),
    (0.50, 0.55, 0.59, 0.64, 0.78),
    (-0.30, -0.22, -0.10, 0.0, 0.10, 0.22, 0.28),
)
"""Chosen: planes between the boxes of the table in x, y, z [m]."""
SCREW = np.linspace(-0.50, 0.44, 48)
"""Chosen: points along the screw [m]; its first end is at the coupling."""
SCREW_BEARINGS = (-0.40, 0.40)
"""Chosen: where the fixed and the loose bearing are along z [m]."""
SCREW_RAIL = slice(7, 44)
"""Chosen: points of the screw that are its rail for the nut."""
THREAD, JOURNAL, BORE = 0.080, 0.055, 0.030
"""Chosen: diameter of the screw at its thread, of its journals and of its bore [m]."""
ROTORS = {
    "x_rotor": (22.0, (0.02, 0.12, 0.12), (0.54, 0.22, 0.80), {"N9b": (0.46, 0.22, 0.80)}),
    "z_rotor": (
        16.0,
        (0.06, 0.06, 0.012),
        (SCREW_X, SCREW_Y, -0.64),
        {"N10b": (SCREW_X, SCREW_Y, -0.71), "N21a": (SCREW_X, SCREW_Y, -0.50)},
    ),
}
"""Chosen: mass [kg], inertias about x, y, z [kg m²], centre and nodes [m] of the motors' rotors. The x-motor spins
about x."""
BED_NODES = {
    "N8a": ((-0.46, 0.38, 0.06), (-0.419, 0.31, 0.06), (0.0, 0.04, 0.06)),
    "N9a": ((0.46, 0.22, 0.80), (0.419, 0.22, 0.80), (0.0, 0.12, 0.12)),
    "N10a": ((SCREW_X, SCREW_Y, -0.71), (SCREW_X, 0.359, -0.71), (0.10, 0.0, 0.10)),
    "N11": ((-0.38, 0.359, -1.15), (-0.38, 0.359, -1.15), (0.03, 0.0, 0.03)),
    "N12": ((0.27, 0.819, -1.08), (0.27, 0.819, -1.08), (0.05, 0.0, 0.05)),
    "N13": ((-0.38, 0.359, 1.05), (-0.38, 0.359, 1.05), (0.03, 0.0, 0.03)),
    "N14": ((0.38, 0.359, 1.05), (0.38, 0.359, 1.05), (0.03, 0.0, 0.03)),
    "N15": ((0.419, 0.15, -0.10), (0.419, 0.15, -0.10), (0.0, 0.06, 0.06)),
    "N16": ((0.06, 0.0, -1.09), (0.06, 0.001, -1.09), (0.10, 0.0, 0.06)),
    "N17": ((-0.35, 0.0, 0.74), (-0.35, 0.001, 0.74), (0.05, 0.0, 0.05)),
    "N18": ((0.37, 0.0, 1.0), (0.37, 0.001, 1.0), (0.05, 0.0, 0.05)),
    "N19a": ((SCREW_X, SCREW_Y, -0.40), (SCREW_X, 0.359, -0.40), (0.10, 0.0, 0.08)),
    "N20a": ((SCREW_X, SCREW_Y, 0.40), (SCREW_X, 0.359, 0.40), (0.10, 0.0, 0.08)),
}
"""Chosen: nodes of the bed: place, middle of the patch of the surface that they follow, half its size [m]."""
TABLE_NODES = {
    "N1a": ((-RAIL_X, RAIL_TOP, -SHOE_Z), (-RAIL_X, 0.501, -SHOE_Z), (0.035, 0.0, 0.05)),
    "N2a": ((RAIL_X, RAIL_TOP, -SHOE_Z), (RAIL_X, 0.501, -SHOE_Z), (0.035, 0.0, 0.05)),
    "N3a": ((-RAIL_X, RAIL_TOP, SHOE_Z), (-RAIL_X, 0.501, SHOE_Z), (0.035, 0.0, 0.05)),
    "N4a": ((RAIL_X, RAIL_TOP, SHOE_Z), (RAIL_X, 0.501, SHOE_Z), (0.035, 0.0, 0.05)),
    "N5a": ((SCREW_X, SCREW_Y, -0.02), (SCREW_X, 0.501, -0.02), (0.05, 0.0, 0.08)),
    "N6": ((-0.35, 0.639, -0.26), (-0.35, 0.639, -0.26), (0.02, 0.0, 0.03)),
    "N7": ((0.17, 0.779, 0.06), (0.17, 0.779, 0.06), (0.06, 0.0, 0.08)),
    "N8b": ((-0.46, 0.38, 0.06), (-0.379, 0.60, 0.06), (0.0, 0.03, 0.06)),
}
"""Chosen: nodes of the table in the same way."""
ELASTIC = {"bed": 16, "table": 6}
"""Elastic modes kept of bed and table."""
SCREW_ELASTIC = {"bending": 3, "axial": 2, "torsion": 2}
"""Elastic modes kept of the screw, bending in each plane."""


def reference_arrays() -> dict[str, Any]:
    """All arrays of the reference machine, named "component.what"; nodes in the order of their names here."""
    arrays: dict[str, Any] = {}
    for name, planes, kept, nodes in (("bed", BED, _bed, BED_NODES), ("table", TABLE, _table, TABLE_NODES)):
        grid = tuple(np.array(axis) for axis in planes)
        body = solid_modes(grid, kept, **CAST_IRON, elastic=ELASTIC[name])
        places = {node: (np.array(at), _patch(middle, half)) for node, (at, middle, half) in nodes.items()}
        shapes = np.stack([body.motion(*place) for place in places.values()])
        sign = _signs(shapes)
        _store(arrays, name, body.eigenvalues, shapes * sign, [place[0] for place in places.values()])
        if name == "bed":
            for rail, x in (("left", -RAIL_X), ("right", RAIL_X)):
                arrays[f"bed.{rail}"] = _along(body, x) * sign
            arrays["bed.coordinate"] = RAIL

    middle = (SCREW[1:] + SCREW[:-1]) / 2
    outer = np.where((middle > SCREW[SCREW_RAIL.start]) & (middle < SCREW[SCREW_RAIL.stop - 1]), THREAD, JOURNAL)
    screw = shaft_modes(SCREW, outer, BORE, **STEEL, **SCREW_ELASTIC)
    ends = (*SCREW_BEARINGS, SCREW[0])
    shapes = np.stack([screw.at(z) for z in ends])
    sign = _signs(shapes)
    _store(arrays, "screw", screw.eigenvalues, shapes * sign, [np.array([SCREW_X, SCREW_Y, z]) for z in ends])
    arrays["screw.coordinate"], arrays["screw.thread"] = SCREW[SCREW_RAIL][::2], screw.shapes[SCREW_RAIL][::2] * sign

    for name, (mass, inertia, centre, nodes) in ROTORS.items():
        scale = 1 / np.sqrt(np.array([mass] * 3 + list(inertia)))
        places = [np.array(at) for at in nodes.values()]
        _store(arrays, name, np.zeros(6), np.stack([_lever(at - np.array(centre)) * scale for at in places]), places)
    return arrays


def _store(arrays: dict[str, Any], name: str, eigenvalues: Any, shapes: Any, positions: list[Any]) -> None:
    arrays[f"{name}.eigenvalues"] = eigenvalues
    arrays[f"{name}.shapes"] = shapes
    arrays[f"{name}.positions"] = np.stack(positions)


def _bed(centre: Float[np.ndarray, "3 boxes"]) -> Bool[np.ndarray, "boxes"]:
    """Top plate, two ridges for the rails, walls of unequal thickness, ribs, ends, feet, motor block off the middle."""
    x, y, z = centre
    side = (x < -0.39) | (x > 0.375)
    ribs = _in(z, -0.66, -0.62) | _in(z, -0.20, -0.16) | _in(z, 0.28, 0.32) | _in(z, 0.58, 0.62)
    ends = (z < -1.166) | (z > 1.06)
    feet = (_in(z, -1.166, -1.02) & _in(x, -0.12, 0.26)) | (_in(z, 0.62, 1.06) & ((x < -0.26) | (x > 0.26)))
    lower = (y < 0.36) & (side | ends | (ribs & (y > 0.05)) | (feet & (y < 0.05)))
    ridges = _in(y, 0.36, 0.42) & (_in(x, -0.34, -0.26) | _in(x, 0.26, 0.34)) & _in(z, -0.66, 0.76)
    block = (y > 0.36) & (z < -0.86) & ((x > 0.12) | ((x > -0.12) & (y < 0.42)))
    return _in(y, 0.315, 0.36) | lower | ridges | block


def _table(centre: Float[np.ndarray, "3 boxes"]) -> Bool[np.ndarray, "boxes"]:
    """Plate, pads for the shoes, a rib for the nut, a block off the middle, and one pocket."""
    x, y, z = centre
    under = (y < 0.55) & (_in(x, -0.34, -0.26) | _in(x, 0.26, 0.34) | _in(x, -0.02, 0.09))
    block = (y > 0.64) & _in(x, 0.09, 0.26) & _in(z, -0.10, 0.22)
    pocket = _in(y, 0.55, 0.59) & _in(x, -0.26, -0.16) & _in(z, -0.10, 0.10)
    return (_in(y, 0.55, 0.64) | under | block) & ~pocket


def _in(value: Any, low: float, high: float) -> Any:
    return (value > low) & (value < high)


def _patch(middle: tuple[float, ...], half: tuple[float, ...]) -> Float[np.ndarray, "points 3"]:
    """Points of a flat patch: five along each side, one across."""
    axes = [np.linspace(-h, h, 5) if h > 0 else np.zeros(1) for h in half]
    return np.array(middle) + np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def _along(body: SolidModes, x: float) -> Float[np.ndarray, "points 6 modes"]:
    """Motion of a guide rail under a shoe at every stored coordinate."""
    return np.stack(
        [body.motion(np.array([x, RAIL_TOP, z]), _patch((x, RAIL_TOP - 0.001, z), (0.035, 0.0, 0.05))) for z in RAIL]
    )


def _lever(place: Float[np.ndarray, "3"]) -> Float[np.ndarray, "6 6"]:
    """Motion of a place of a rigid body under unit motions of its centre."""
    return np.concatenate([rigid_motions(place[:, None]), np.eye(6)[3:]])


def _signs(shapes: Float[np.ndarray, "nodes 6 modes"]) -> Float[np.ndarray, "modes"]:
    """Signs that make the greatest entry of every mode positive."""
    flat = shapes.reshape(-1, shapes.shape[-1])
    return np.sign(flat[np.abs(flat).argmax(axis=0), np.arange(flat.shape[1])])


def main() -> None:
    """Write the arrays beside the module that reads them."""
    np.savez_compressed(str(files("twin.structure") / "reference_machine.npz"), **reference_arrays())


if __name__ == "__main__":
    main()
