"""A ball screw axis with its elastic parts, motor and position controller."""

from twin.control import ClosedLoop, PositionVelocityPI
from twin.drives import mauro_axis

HELP = "ball screw with elastic screw, nut, bearing and support, DC motor and cascade of P position and PI velocity"


def model() -> ClosedLoop:
    """The axis with plausible values."""
    axis = mauro_axis()
    controller = PositionVelocityPI(
        position_gain=45.0, velocity_gain=1.0, integral_gain=30.0, lead=float(axis.lead), voltage_limit=300.0
    )
    return ClosedLoop(axis, controller)


REST = """
# What is searched: bounds with units.
[free]
"plant.springs.support" = { lower = "1e8 N/m", upper = "2e9 N/m", scale = "log" }
"plant.slide_mass" = { lower = "50 kg", upper = "800 kg", scale = "log" }
"plant.friction.coulomb" = { lower = "0 N m", upper = "10 N m" }
"controller.position_gain" = { lower = "10 1/s", upper = "90 1/s" }

[simulate]
duration = "0.4 s"
rate = "4 kHz"

[simulate.reference]
type = "JerkLimitedMove"
distance = "20 mm"
velocity_limit = "0.3 m/s"
acceleration_limit = "2 m/s^2"
jerk_limit = "60 m/s^3"
start_time = "20 ms"

[modes]

[sweep]
outputs = ["max_error(position)", "frequency(1)"]

[sweep.over]
"plant.slide_mass" = { from = "100 kg", to = "400 kg", count = 7 }
"controller.position_gain" = { from = "20 1/s", to = "60 1/s", count = 5 }

[rank]
outputs = ["frequency(1)", "rms_error(position)"]
samples = 64
"""
