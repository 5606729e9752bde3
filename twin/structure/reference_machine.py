"""A stand-in for the machine of Ellinger et al.: bed on three mounting elements, table on four guide shoes, ball screw.

Published are the parts, which 27 of their parameters are unknown, the 32 nodes (Table 1), the four axis positions and
that the first 20 modes end near 311 Hz, lightly damped. The component models and every value below are ours, of the
size of parts in catalogues, chosen so that these statements hold and that each unknown shows in the modes.
"""

import functools
from collections.abc import Sequence
from importlib.resources import files
from typing import Any

import numpy as np
from jaxtyping import Float

from twin.structure.component import Component
from twin.structure.directions import Directions
from twin.structure.joint import Attachment, Joint
from twin.structure.lumped_mass import LumpedMass
from twin.structure.machine import Machine
from twin.structure.rail import Rail
from twin.structure.reference_quantities import DISTURBABLE as DISTURBABLE
from twin.structure.reference_quantities import UNKNOWN as UNKNOWN

POSITIONS = (-0.294, -0.06, 0.135, 0.33)
"""Axis positions z1 to z4 [m]; section 3.1. The first is held back from the identification."""
MODES = 20
"""Number of modes, up to 311 Hz; section 3.2."""

LOSS_FACTOR = {"bed": 0.004, "table": 0.004, "screw": 0.003, "x_rotor": 0.003, "z_rotor": 0.003}
"""Chosen: material damping of the components [-]."""
JOINT_LOSS_FACTOR = 0.008
"""Chosen, known: hysteretic damping of all joints but the mounting elements, as a share of their stiffness [-]."""
MOUNTING = (
    {"stiffness": (4.0e7, 8.0e7, 3.2e7), "viscous": (1.55e4, 7.0e3), "hysteretic": 8.0e6},
    {"stiffness": (3.0e7, 7.0e7, 4.2e7), "viscous": (2.0e4, 2.2e4), "hysteretic": 6.5e6},
    {"stiffness": (4.0e7, 6.0e7, 2.6e7), "viscous": (2.0e4, 1.4e4), "hysteretic": 5.0e6},
)
"""Chosen: mounting elements 1 to 3: k_x, k_y, k_z [N/m], b_x, b_z [Ns/m], d_y [N/m]."""
MOUNTING_REST = (2e4, 2e4, 1e4)
"""Chosen, known: stiffness of every mounting element about x, y, z [Nm/rad]."""
FIXED_BEARING = {"x": 5.0e8, "y": 4.5e8, "z": 2.2e8, "rx": 4e5, "ry": 3.4e5}
"""Chosen: fixed bearing [N/m, Nm/rad]; its k_z is unknown."""
LOOSE_BEARING = {"x": 4.0e8, "y": 3.5e8}
"""Chosen, known: loose bearing [N/m]."""
COUPLING = {"x": 4e6, "y": 5e6, "z": 8e6, "rx": 400.0, "ry": 500.0, "rz": 2.8e4}
"""Chosen: coupling [N/m, Nm/rad]; its k_rz is unknown."""
COUPLING_LOSS = 1300.0
"""Chosen: hysteretic damping d_rz of the coupling [Nm/rad]."""
NUT = {"x": 5.0e8, "y": 4.5e8, "z": 2.8e8, "rx": 3e5, "ry": 2.5e5, "rz": 120.0}
"""Chosen: nut on the screw [N/m, Nm/rad]; k_z is unknown; rz replaces friction."""
NUT_LOSS = 15.0
"""Chosen: hysteretic damping d_rz of the nut [Nm/rad]."""
LEAD = 0.02
"""Chosen, known: lead of the screw [m per turn]."""
GUIDE = {"x": 1.45e8, "y": 1.3e8, "z": 2.5e6, "rx": 1.2e6, "ry": 9e5, "rz": 3e5}
"""Chosen: guide shoe [N/m, Nm/rad]; k_x, k_y, k_rx, k_ry are unknown, z replaces friction."""
Z_MOTOR_BEARING = {"x": 4e8, "y": 4e8, "z": 3e8, "rx": 4e6, "ry": 4e6}
"""Chosen, known: bearings of the z-motor [N/m, Nm/rad]."""
X_MOTOR_BEARING = {"x": 4e8, "y": 5e8, "z": 5e8, "ry": 5e6, "rz": 5e6}
"""Chosen, known: bearings of the x-motor, which spins about x [N/m, Nm/rad]."""
Z_BRAKE, X_BRAKE = 90.0, 4e5
"""Chosen, known: torsional stiffness of the brakes [Nm/rad]: that of the z-axis is open, friction remains; that of the
x-axis is applied."""
SHOE_OFFSETS = (-0.16, 0.16)
"""Chosen: coordinate of the front and the back shoes on their rail at axis position zero [m]."""
NUT_OFFSET = -0.02
"""Chosen: coordinate of the nut on the screw at axis position zero [m]."""
MASSES = {
    "z_motor_housing": (70.0, "bed", "N10a", (1.2, 0.9, 0.9)),
    "x_motor_housing": (60.0, "bed", "N9a", (0.8, 1.0, 1.0)),
    "fixed_bearing_housing": (14.0, "bed", "N19a", (0.08, 0.06, 0.08)),
    "loose_bearing_housing": (9.0, "bed", "N20a", (0.04, 0.03, 0.04)),
    "encoder_scale": (3.0, "bed", "N8a", (0.02, 0.02, 0.002)),
    "encoder_head": (1.5, "table", "N8b", (0.003, 0.003, 0.002)),
    "nut_housing": (12.0, "table", "N5a", (0.06, 0.06, 0.05)),
    "workpiece": (40.0, "table", "N7", (0.3, 0.3, 0.3)),
    "clamp": (5.0, "table", "N6", (0.01, 0.01, 0.01)),
    "coupling_hub": (1.8, "screw", "N21b", (0.002, 0.002, 0.0018)),
    "fixed_bearing_ring": (2.5, "screw", "N19b", (0.003, 0.003, 0.002)),
    "loose_bearing_ring": (1.5, "screw", "N20b", (0.002, 0.002, 0.001)),
    "brake_disc": (2.0, "z_rotor", "N10b", (0.002, 0.002, 0.003)),
    "x_brake_disc": (3.0, "x_rotor", "N9b", (0.006, 0.004, 0.004)),
    "control_box": (12.0, "bed", "N12", (0.2, 0.2, 0.2)),
    "cover": (8.0, "bed", "N13", (0.1, 0.1, 0.1)),
    "hose_carrier": (6.0, "bed", "N15", (0.05, 0.05, 0.05)),
}
"""Chosen: lumped masses: mass [kg], component, node, inertias about x, y, z [kg m²]."""
NODES = {
    "bed": ("N8a", "N9a", "N10a", "N11", "N12", "N13", "N14", "N15", "N16", "N17", "N18", "N19a", "N20a"),
    "table": ("N1a", "N2a", "N3a", "N4a", "N5a", "N6", "N7", "N8b"),
    "screw": ("N19b", "N20b", "N21b"),
    "x_rotor": ("N9b",),
    "z_rotor": ("N10b", "N21a"),
}
"""Nodes of Table 1 on each component; N1b to N5b travel along its rails."""


def reference_machine() -> Machine:
    """The nominal machine: five components with 62 modes, twelve joints, lumped masses; no unconstrained motion."""
    arrays = _arrays()
    components = {}
    for name, nodes in NODES.items():
        values, shapes, positions = (arrays[f"{name}.{what}"] for what in ("eigenvalues", "shapes", "positions"))
        components[name] = Component(
            values, shapes, positions, nodes, loss_factor=LOSS_FACTOR[name], rails=_rails(name)
        )
    masses = {
        name: LumpedMass(mass, component, node, *inertia) for name, (mass, component, node, inertia) in MASSES.items()
    }
    return Machine(components, _joints(), masses)


@functools.cache
def _arrays() -> dict[str, Float[np.ndarray, "..."]]:
    with (files("twin.structure") / "reference_machine.npz").open("rb") as file:
        return dict(np.load(file, allow_pickle=False))


def _rails(name: str) -> dict[str, Rail]:
    arrays = _arrays()
    if name == "bed":
        return {rail: Rail(arrays["bed.coordinate"], arrays[f"bed.{rail}"]) for rail in ("left", "right")}
    return {"thread": Rail(arrays["screw.coordinate"], arrays["screw.thread"])} if name == "screw" else {}


def _joints() -> dict[str, Joint]:
    joints = {}
    for number, (node, values) in enumerate(zip(("N16", "N17", "N18"), MOUNTING, strict=True), start=1):
        (k_x, k_y, k_z), (b_x, b_z), rest = values["stiffness"], values["viscous"], MOUNTING_REST
        joints[f"mounting_{number}"] = Joint(
            [(Attachment("bed", node), None)],
            Directions(k_x, k_y, k_z, *rest),
            Directions(x=b_x, z=b_z),
            Directions(y=values["hysteretic"]),
        )
    shoes = [
        (Attachment("table", f"N{i}a"), Attachment("bed", rail=rail, offset=offset, name=f"N{i}b"))
        for i, (rail, offset) in enumerate(((r, z) for z in SHOE_OFFSETS for r in ("left", "right")), start=1)
    ]
    nut = (Attachment("table", "N5a"), Attachment("screw", rail="thread", offset=NUT_OFFSET, name="N5b"))
    joints |= {
        "guide": _joint(shoes, GUIDE),
        "ball_screw": _joint([nut], NUT, {"rz": NUT_LOSS}, lead=LEAD),
        "fixed_bearing": _between(("screw", "N19b"), ("bed", "N19a"), FIXED_BEARING),
        "loose_bearing": _between(("screw", "N20b"), ("bed", "N20a"), LOOSE_BEARING),
        "coupling": _between(("z_rotor", "N21a"), ("screw", "N21b"), COUPLING, {"rz": COUPLING_LOSS}),
        "z_motor_bearing": _between(("z_rotor", "N10b"), ("bed", "N10a"), Z_MOTOR_BEARING),
        "x_motor_bearing": _between(("x_rotor", "N9b"), ("bed", "N9a"), X_MOTOR_BEARING),
        "z_brake": _between(("z_rotor", "N10b"), ("bed", "N10a"), {"rz": Z_BRAKE}),
        "x_brake": _between(("x_rotor", "N9b"), ("bed", "N9a"), {"rx": X_BRAKE}),
    }
    return joints


def _between(
    first: tuple[str, str], second: tuple[str, str], stiffness: dict[str, float], loss: dict[str, float] | None = None
) -> Joint:
    return _joint([(Attachment(*first), Attachment(*second))], stiffness, loss)


def _joint(
    pairs: Sequence[tuple[Attachment, Attachment | None]],
    stiffness: dict[str, float],
    loss: dict[str, float] | None = None,
    lead: float = 0.0,
) -> Joint:
    used: Any = tuple(stiffness)
    hysteretic = {direction: JOINT_LOSS_FACTOR * value for direction, value in stiffness.items()} | (loss or {})
    return Joint(pairs, Directions(**stiffness), None, Directions(**hysteretic), lead=lead, directions=used)
