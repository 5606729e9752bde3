"""An axis whose controller nobody knows, driven by its measured current."""

from twin.drives import CurrentDrivenAxis
from twin.laws import StribeckFriction

HELP = "one moved mass with friction, driven by the measured current: for an axis whose controller is not known"


def model() -> CurrentDrivenAxis:
    """The axis with plausible values."""
    friction = StribeckFriction(
        coulomb=200.0, static=300.0, stribeck_velocity=1e-3, viscous=1000.0, width=3e-4, exponent=1.0
    )
    return CurrentDrivenAxis(torque_constant=0.5, travel_per_turn=0.010, mass=1000.0, friction=friction)


REST = """
# Known from data sheets: torque_constant and travel_per_turn, for a screw its lead. For a pinion, travel_per_turn is
# its circumference over the gear ratio. A current that was recorded as amplitude or as rms needs the torque constant
# that belongs to it. If the axis moves the other way than its current, write sign = -1 into the channel.

# What is searched: bounds with units. scale = "log" suits what may be wrong by a factor.
[free]
mass = { lower = "1 kg", upper = "100 t", scale = "log" }       # with the inertia of motor and screw
"friction.coulomb" = { lower = "0 N", upper = "50 kN" }
"friction.viscous" = { lower = "0 N s/m", upper = "200 kN s/m" }
offset = { lower = "-20 kN", upper = "20 kN" }
# What holds the axis as it gets moving. `fit` needs it, or the model drifts away at each start; these two make up for
# whatever happens at standstill, so do not take them for measured.
"friction.static" = { lower = "0 N", upper = "50 kN" }
"friction.stribeck_velocity" = { lower = "0.1 mm/s", upper = "20 mm/s", scale = "log" }
# Mass and friction are no better known than the torque constant. `fit` counts that in by this line, with the mean and
# standard deviation of what the data sheet says:
# torque_constant = { lower = "0.1 N m/A", upper = "2 N m/A", prior = ["0.5 N m/A", "0.02 N m/A"] }

# One table for each file. `drivetwin look FILE` lists channels and writes the lines below.
[data.run1]
file = "axis.csv"
inputs = { command = "current" }                            # the channel that drives the axis
initial = { initial_position = "position" }                 # the axis starts at the first sample
# start = "0.2 s"                                           # part of the record, to begin at standstill
# stop = "5 s"

[data.run1.channels]                                        # names on the left are those of the model
position = { column = "x", unit = "mm" }
current = { column = "i", unit = "A" }                      # sign = -1, delay = "1 ms" if needed

# Without a start and without simulation, by the balance of forces: drivetwin identify. Begin with this; `fit` can then
# go on from fitted.toml in its folder.
[identify]
procedure = "inverse_dynamics"
free = ["mass", "friction.coulomb", "friction.viscous", "offset"]   # of [free]; the others are only seen at standstill
# slowest = "10 mm/s"             # slower samples are left out, as friction at standstill can be anything

# By simulation: drivetwin fit. It also shows how far the model drifts away from the record.
[fit]
starts = 1                      # more: drawn between the bounds, as one batch
controls = true                 # predict data held back, and try shuffled data
correlated = true               # what is left over is mostly a model error, which has memory

# Without data: what would the axis do?
[simulate]
duration = "0.3 s"
inputs = { command = "5 A" }    # from time 0 on

[sweep]
outputs = ["last(position)", "max(velocity)"]

[sweep.over]
mass = { from = "500 kg", to = "2 t", count = 7 }

[rank]
outputs = ["last(position)"]
samples = 64
"""
