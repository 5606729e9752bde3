"""The axis of Mauro et al.: what they publish about it, and a labelled stand-in for what they do not.

Published are the structure (Fig. 2), the first natural frequency, its damping ratio, that the support's spring deforms
at least twice as much as any other in that mode (Fig. 9), and Table 1. Every mass, inertia, stiffness, dimension, motor
constant and friction level below is ours, of the size of parts in catalogues, chosen so that these statements hold.
"""

from typing import Any

from twin.drives.ball_screw import BallScrewAxis
from twin.drives.ball_screw_catalogue import ball_screw_axis
from twin.drives.dc_motor import DcMotor
from twin.laws import StribeckFriction

FIRST_FREQUENCY = 152.0
"""First natural frequency above zero, the nut at mid-stroke [Hz]; section 5."""
DAMPING_RATIO = 0.03
"""Damping ratio of that mode [-]; section 5."""

LEAD = 0.02
"""Chosen: lead [m]."""
SHAFT_DIAMETER = 0.045
"""Chosen: root diameter of the screw [m]."""
LENGTH = 1.5
"""Chosen: length of the screw [m]."""
NUT_POSITION = 0.75
"""Chosen: distance of the nut from the fixed bearing at mid-stroke [m]."""
HALF_STROKE = 0.5
"""Chosen: travel of the slide to either side of mid-stroke [m]."""
END = (0.03, 0.12)
"""Chosen: diameter and length of the screw's end journal [m]."""
MOTOR = (0.35, 4e-3, 1.5, 1.5)
"""Chosen: resistance [Ohm], inductance [H], back EMF [Vs/rad] and torque constant [Nm/A], as of a 20 Nm servo motor."""
MOTOR_INERTIA = 3e-3
"""Chosen: inertia of the rotor [kg m²]."""
MOTOR_SHAFT = 6e4
"""Chosen: torsional stiffness of the motor's shaft [Nm/rad]."""
COUPLING = (5e4, 6e-4)
"""Chosen: torsional stiffness [Nm/rad] and inertia [kg m²] of the coupling."""
BEARING = 3e9
"""Chosen: axial stiffness of the roller pack [N/m]."""
SUPPORT = 4.0507e8
"""Chosen: axial stiffness of the metal support [N/m]; set so that the first frequency is the published one."""
NUT = 1.5e9
"""Chosen: axial stiffness of the preloaded nut [N/m]."""
FLANGE = 3e9
"""Chosen: axial stiffness of the nut's flange [N/m]."""
NUT_MASS = 5.0
"""Chosen: mass of the nut [kg]."""
SLIDE_MASS = 200.0
"""Chosen: mass of the slide [kg]."""
FRICTION = (1.2, 1.8, 4.0, 0.01, 0.3)
"""Chosen: Coulomb level [Nm], breakaway torque [Nm], Stribeck speed [rad/s], viscous coefficient [Nms/rad] and width
[rad/s]; the measured curve of Fig. 6 is not published in numbers."""


def mauro_axis(**changed: Any) -> BallScrewAxis:
    """A ball screw axis of which hold the published statements: 152 Hz, 3 %, and a support that deforms most.

    Args:
        **changed: values of `ball_screw_axis` to be otherwise; the statements need not hold any more.

    Raises:
        InputError: if a value is out of its range.
    """
    values = {
        "shaft_diameter": SHAFT_DIAMETER,
        "length": LENGTH,
        "lead": LEAD,
        "nut_position": NUT_POSITION,
        "end_diameter": END[0],
        "end_length": END[1],
        "motor": DcMotor(*MOTOR),
        "motor_inertia": MOTOR_INERTIA,
        "motor_shaft": MOTOR_SHAFT,
        "coupling": COUPLING[0],
        "coupling_inertia": COUPLING[1],
        "bearing": BEARING,
        "support": SUPPORT,
        "nut": NUT,
        "flange": FLANGE,
        "nut_mass": NUT_MASS,
        "slide_mass": SLIDE_MASS,
        "friction": StribeckFriction(*FRICTION),
        "damping_ratio": DAMPING_RATIO,
    }
    return ball_screw_axis(**(values | changed))
