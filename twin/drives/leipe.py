"""The bench of Leipe et al. as a drive: what they publish, and labelled stand-ins for what they do not."""

from twin._checks import InputError
from twin.drives.rack_pinion import DriveTrain, RackPinionDrive
from twin.laws import Backlash, CoulombViscousFriction, HyperbolicDamping, RootStiffness, SecantMesh, TangentMesh

RATED_TORQUE = 12.5
"""Rated torque of each motor [Nm]; section IV."""
GEAR_RATIO = 16.0
"""Ratio of the gearboxes i_g [-]; section IV."""
PINION_DIAMETER = 0.08488
"""Pitch diameter of the pinions d_p [m]; section IV."""
TABLE_MASS = 403.8
"""Mass moved in translation m [kg]; section IV."""
STIFFNESS = (1.8709e7, 5.6406)
"""k1 [N/m, for F in N] and k2 [-] of each drive train; eq. 6."""
DAMPING = (9.5376e5, 148.3813, 2.0734e4)
"""d1 [N²s/m], d2 [N] and d3 [Ns/m] of each drive train; eq. 10."""

MOTOR_INERTIA = 7.5e-3
"""Chosen, not published: inertia of motor, gearbox and pinion at the motor shaft [kg m²], of the size of the motors and
gearboxes named in section IV."""
TORQUE_LIMIT = 30.0
"""Chosen: largest torque of each motor [Nm]."""
PLAY = 40e-6
"""Chosen: play of each mesh [m]."""
MOTOR_FRICTION = (0.15, 4e-4)
"""Chosen: Coulomb friction [Nm] and viscous coefficient [Nms/rad] of each motor with its gearbox."""
TABLE_FRICTION = (120.0, 250.0)
"""Chosen: Coulomb friction [N] and viscous coefficient [Ns/m] of the guides."""


def leipe_drive(reading: str = "tangent", *, play: float = PLAY) -> RackPinionDrive:
    """The bench, both drive trains alike.

    Args:
        reading: "tangent" where k(F) is the slope of the force at the force through the mesh, "secant" where it is the
            ratio of force and deflection at the motor's force.
        play: play of each mesh [m].

    Raises:
        InputError: unknown reading, a play that is negative.
    """
    if reading not in ("tangent", "secant"):
        raise InputError(f'reading must be "tangent" or "secant", but is {reading!r}. Choose one of the two.')
    mesh = TangentMesh if reading == "tangent" else SecantMesh
    train = DriveTrain(
        inertia=MOTOR_INERTIA,
        friction=CoulombViscousFriction(*MOTOR_FRICTION, width=0.2),
        mesh=mesh(RootStiffness(*STIFFNESS), HyperbolicDamping(*DAMPING), Backlash(play)),
        torque_limit=TORQUE_LIMIT,
    )
    guides = CoulombViscousFriction(*TABLE_FRICTION, width=5e-4)
    return RackPinionDrive(train, train, TABLE_MASS, guides, GEAR_RATIO, PINION_DIAMETER)
