"""A rigid axis under a sampled position controller."""

from fitting.demo import demo_axis
from twin.control import SampledLoop
from twin.paths import set_leaves

HELP = "one moved mass with friction, motor and sampled position controller: the first model of any axis"


def model() -> SampledLoop:
    """The axis with plausible values."""
    return set_leaves(demo_axis(), {"plant.friction.width": 1e-4})


REST = """
# An axis that rests under load creeps in the model, by the width of its friction. Where the record has such standstills
# and what is left over is largest there, make plant.friction.width smaller.

# What is searched: bounds with units. scale = "log" suits what may be wrong by a factor.
[free]
"plant.mass" = { lower = "10 kg", upper = "1000 kg", scale = "log" }
"plant.friction.coulomb" = { lower = "0 N", upper = "200 N" }
"plant.friction.static" = { lower = "0 N", upper = "200 N" }
"plant.friction.stribeck_velocity" = { lower = "1 mm/s", upper = "100 mm/s", scale = "log" }
"plant.friction.viscous" = { lower = "0 N s/m", upper = "2000 N s/m" }
"plant.offset" = { lower = "-50 N", upper = "50 N" }
# A prior is a mean and a standard deviation: prior = ["95 kg", "5 kg"]

# One table for each file. `drivetwin look FILE` lists channels and writes the lines below.
[data.run1]
file = "axis.csv"
reference = "set"                                           # channel that the controller follows
initial = { "plant.initial_position" = "position" }         # the axis starts at the first sample
# start = "0.2 s"                                           # part of the record
# stop = "5 s"
# rate = "1 kHz"                                            # resample to the controller's rate

[data.run1.channels]                                        # names on the left are those of the model
set = { column = "x_set", unit = "mm" }
position = { column = "x", unit = "mm", deviation = "1 um" }   # deviation: standard deviation of the noise
command = { column = "u", unit = "V", deviation = "50 mV" }    # sign = -1, delay = "1 ms", detrend = "mean" if needed

[fit]
starts = 1                      # more: drawn between the bounds, as one batch
controls = true                 # predict data held back, and try shuffled data

# Without data: what would the axis do?
[simulate]
duration = "1.2 s"

[simulate.reference]
type = "JerkLimitedMove"
distance = "0.2 m"
velocity_limit = "0.5 m/s"
acceleration_limit = "2 m/s^2"
jerk_limit = "40 m/s^3"
start_time = "50 ms"

[sweep]
outputs = ["max_error(position)", "max(command)"]

[sweep.over]
"plant.mass" = { from = "50 kg", to = "150 kg", count = 11 }
"controller.position_gain" = ["80 1/s", "120 1/s", "160 1/s"]

[rank]
outputs = ["rms_error(position)", "rms(command)"]
samples = 128
"""
