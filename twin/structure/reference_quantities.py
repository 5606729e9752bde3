"""Which quantities of the reference machine are unknown, and which others may be disturbed."""

from typing import NamedTuple


class Quantity(NamedTuple):
    """A parameter of the reference machine."""

    name: str
    """Short name, as in the paper: "ME1 k_x"."""
    path: str
    """Where it is in the machine: "joints.mounting_1.stiffness.x"."""
    unit: str
    """SI unit, empty for a plain number."""
    kind: str
    """What it is: stiffness, viscous or hysteretic for the unknown ones."""


def _mounting(number: int) -> tuple[Quantity, ...]:
    law, name = f"joints.mounting_{number}", f"ME{number}"
    return (
        *(Quantity(f"{name} k_{d}", f"{law}.stiffness.{d}", "N/m", "stiffness") for d in "xyz"),
        *(Quantity(f"{name} b_{d}", f"{law}.viscous.{d}", "Ns/m", "viscous") for d in "xz"),
        Quantity(f"{name} d_y", f"{law}.hysteretic.y", "N/m", "hysteretic"),
    )


UNKNOWN = (
    *_mounting(1),
    *_mounting(2),
    *_mounting(3),
    Quantity("FB k_z", "joints.fixed_bearing.stiffness.z", "N/m", "stiffness"),
    Quantity("CPL k_rz", "joints.coupling.stiffness.rz", "Nm/rad", "stiffness"),
    Quantity("CPL d_rz", "joints.coupling.hysteretic.rz", "Nm/rad", "hysteretic"),
    Quantity("BSD k_z", "joints.ball_screw.stiffness.z", "N/m", "stiffness"),
    Quantity("BSD d_rz", "joints.ball_screw.hysteretic.rz", "Nm/rad", "hysteretic"),
    Quantity("LGS k_x", "joints.guide.stiffness.x", "N/m", "stiffness"),
    Quantity("LGS k_y", "joints.guide.stiffness.y", "N/m", "stiffness"),
    Quantity("LGS k_rx", "joints.guide.stiffness.rx", "Nm/rad", "stiffness"),
    Quantity("LGS k_ry", "joints.guide.stiffness.ry", "Nm/rad", "stiffness"),
)
"""The 27 unknown parameters: 16 stiffnesses, 11 dampings; section 3.1."""


def _disturbable(path: str) -> Quantity:
    """A quantity from its path, which tells what it is."""
    room, part, *rest = path.split(".")
    what, last = rest[0], rest[-1]
    if room == "masses":
        return Quantity(f"{part} {what}", path, "kg" if what == "mass" else "kg m²", "lumped mass")
    if what == "frequency":
        return Quantity(f"{part} mode {int(last) + 1}", path, "", what)
    if what == "stiffness":
        return Quantity(f"{part} k_{last}", path, "Nm/rad" if last.startswith("r") else "N/m", what)
    if what == "pairs":
        return Quantity(f"{part} offset {int(rest[1]) + 1}", path, "m", "geometry")
    return Quantity(f"{part} {what}", path, "", what)


DISTURBABLE = tuple(
    _disturbable(path)
    for path in (
        "masses.workpiece.inertia_y",
        "masses.loose_bearing_ring.inertia_z",
        "masses.coupling_hub.mass",
        "components.table.frequency.11",
        "masses.workpiece.inertia_x",
        "masses.encoder_head.mass",
        "joints.ball_screw.stiffness.ry",
        "joints.guide.stiffness.rz",
        "masses.coupling_hub.inertia_z",
        "components.screw.frequency.15",
        "joints.ball_screw.stiffness.rx",
        "joints.ball_screw.stiffness.x",
        "masses.fixed_bearing_ring.inertia_z",
        "joints.coupling.stiffness.z",
        "joints.loose_bearing.stiffness.x",
        "joints.ball_screw.stiffness.y",
        "components.screw.frequency.13",
        "joints.fixed_bearing.stiffness.x",
        "joints.loose_bearing.stiffness.y",
        "joints.fixed_bearing.stiffness.rx",
        "joints.ball_screw.pairs.0.1.offset",
        "components.bed.frequency.18",
        "masses.fixed_bearing_housing.mass",
        "joints.fixed_bearing.stiffness.ry",
        "joints.fixed_bearing.stiffness.y",
        "masses.cover.mass",
        "components.screw.frequency.7",
        "components.screw.frequency.14",
        "masses.control_box.mass",
        "components.screw.frequency.10",
        "components.table.frequency.8",
        "masses.nut_housing.mass",
        "masses.clamp.mass",
        "joints.z_brake.stiffness.rz",
        "components.bed.frequency.20",
        "components.bed.frequency.19",
        "masses.z_motor_housing.inertia_x",
        "components.x_rotor.density",
        "joints.ball_screw.stiffness.rz",
        "components.bed.frequency.17",
        "joints.guide.stiffness.z",
        "components.table.frequency.6",
        "components.bed.frequency.21",
        "joints.guide.pairs.1.1.offset",
        "masses.z_motor_housing.mass",
        "components.screw.frequency.12",
        "joints.guide.pairs.3.1.offset",
        "components.bed.frequency.13",
        "masses.x_motor_housing.mass",
        "components.bed.frequency.15",
        "joints.guide.pairs.0.1.offset",
        "components.bed.frequency.16",
        "joints.guide.pairs.2.1.offset",
        "components.bed.frequency.14",
        "components.table.frequency.10",
        "masses.brake_disc.inertia_z",
        "components.table.frequency.7",
        "masses.workpiece.mass",
        "components.table.modulus",
        "components.table.frequency.9",
        "components.screw.modulus",
        "components.screw.frequency.9",
        "components.bed.frequency.12",
        "components.screw.density",
        "components.screw.frequency.6",
        "components.z_rotor.density",
        "components.bed.frequency.6",
        "components.bed.frequency.7",
        "components.bed.frequency.8",
        "components.bed.frequency.9",
        "components.table.density",
        "components.bed.modulus",
        "components.bed.frequency.10",
        "components.bed.density",
        "components.bed.frequency.11",
    )
)
"""75 other quantities that may be disturbed: bearing and friction replacement stiffnesses, natural frequencies of the
components, lumped masses, densities, moduli, places. The least sensitive come first: what counts is the rms change of
the evidence of the first 20 modes at the four positions, in standard deviations of a measurement, per relative change
of the quantity. It grows from 0.26 for the first over 6.9 for the 44th and 16 for the 60th to 219 for the last, so
that none is without effect. What moves no frequency by 0.4 % of its own change is left out."""
