"""The axis that the twin of Mauro's Table 1 is built on: what of `twin.drives.mauro` the table asks to be otherwise.

The travel that Table 1 asks for needs a longer screw, the moved mass half the lead and another motor; the support is
as stiff as the first natural frequency of 152 Hz asks for. Every value is chosen.
"""

from twin.drives.ball_screw import BallScrewAxis
from twin.drives.dc_motor import DcMotor
from twin.drives.mauro import mauro_axis

LEAD = 0.01
"""Chosen: lead [m]."""
SHAFT_DIAMETER = 0.05
"""Chosen: root diameter of the screw [m]."""
LENGTH = 2.0
"""Chosen: length of the screw [m]."""
NUT_POSITION = 1.0
"""Chosen: distance of the nut from the fixed bearing at mid-stroke [m]."""
HALF_STROKE = 0.95
"""Chosen: travel of the slide to either side of mid-stroke [m]."""
MOTOR = (1.7, 0.0175, 0.51, 0.51)
"""Chosen: resistance [Ohm], inductance [H], voltage constant [Vs/rad] and torque constant [Nm/A]."""
MOTOR_INERTIA = 3.5e-3
"""Chosen: inertia of the rotor [kg m²]."""
SUPPORT = 7.8647e8
"""Chosen: axial stiffness of the metal support [N/m]; set so that the first frequency is the published one."""


def table_axis() -> BallScrewAxis:
    """A ball screw axis with 152 Hz, 3 %, a support that deforms most, and the travel of Table 1."""
    return mauro_axis(
        shaft_diameter=SHAFT_DIAMETER,
        length=LENGTH,
        lead=LEAD,
        nut_position=NUT_POSITION,
        motor=DcMotor(*MOTOR),
        motor_inertia=MOTOR_INERTIA,
        support=SUPPORT,
    )
