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


def _disturbable() -> tuple[Quantity, ...]:
    found = [
        *(Quantity(f"{c} density", f"components.{c}.density", "", "density") for c in ("x_rotor", "z_rotor", "screw")),
        *(
            Quantity(f"{c} mode {i + 1}", f"components.{c}.frequency.{i}", "", "frequency")
            for c, first, last in (("bed", 12, 22), ("table", 6, 12), ("screw", 6, 16))
            for i in range(first, last)
        ),
        *(
            Quantity(f"{joint} k_{d}", f"joints.{joint}.stiffness.{d}", "N/m" if len(d) == 1 else "Nm/rad", "stiffness")
            for joint, directions in (
                ("fixed_bearing", ("x", "y", "rx", "ry")),
                ("loose_bearing", ("x", "y")),
                ("coupling", ("x", "y", "z")),
                ("ball_screw", ("x", "y", "rx", "ry")),
                ("z_motor_bearing", ("x", "y", "z", "rx", "ry")),
                ("x_motor_bearing", ("x", "y", "z", "ry", "rz")),
                ("x_brake", ("rx",)),
            )
            for d in directions
        ),
    ]
    return tuple(found)


DISTURBABLE = _disturbable()
"""Other quantities that may be disturbed."""
