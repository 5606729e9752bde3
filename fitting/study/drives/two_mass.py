"""Motor and load coupled by a shaft."""

from twin.drives import TwoMass
from twin.laws import ViscousFriction

HELP = "motor and load coupled by a shaft, driven by a current: the smallest drive with a resonance"


def model() -> TwoMass:
    """The drive with plausible values."""
    return TwoMass(
        motor_inertia=2e-3,
        load_inertia=3e-3,
        stiffness=100.0,
        damping=0.02,
        motor_friction=ViscousFriction(5e-3),
        load_friction=ViscousFriction(2e-3),
        gain=0.5,
    )


REST = """
# What is searched: bounds with units. scale = "log" suits what may be wrong by a factor.
# The torque constant (gain) cannot be told from motions alone: it scales all others.
[free]
motor_inertia = { lower = "1e-4 kg m^2", upper = "1 kg m^2", scale = "log" }
load_inertia = { lower = "1e-4 kg m^2", upper = "1 kg m^2", scale = "log" }
stiffness = { lower = "1 N m/rad", upper = "1e5 N m/rad", scale = "log" }
damping = { lower = "0 N m s/rad", upper = "1 N m s/rad" }
"motor_friction.viscous" = { lower = "0 N m s/rad", upper = "0.2 N m s/rad" }
"load_friction.viscous" = { lower = "0 N m s/rad", upper = "0.2 N m s/rad" }

# One table for each file. `drivetwin look FILE` lists channels and writes the lines below.
[data.run1]
file = "drive.mat"
inputs = { command = "current" }                            # channel that drives the motor
hold = true                     # the current is held from sample to sample; false: straight lines between samples

[data.run1.channels]                                        # names on the left are those of the model
current = { column = "i", unit = "A" }
position = { column = "phi_motor", unit = "rad", from_zero = true }
load_position = { column = "phi_load", unit = "rad", from_zero = true }

# A measured frequency response instead, or as well:
# [data.taps]
# kind = "frf"
# file = "response.csv"
# band = ["5 Hz", "300 Hz"]     # narrow it to the lines around antiresonance and resonance
# outputs = { position = "phi_motor", load_position = "phi_load" }
# inputs = { command = "i" }

[fit]
starts = 1                      # more: drawn between the bounds, as one batch; begin with few, long records take time
controls = true                 # predict data held back, and try shuffled data

[frf]
from = "1 Hz"
to = "500 Hz"
outputs = ["position", "load_position"]

[simulate]
duration = "0.5 s"
rate = "4 kHz"
inputs = { command = "1 A" }    # from time 0 on

[sweep]
outputs = ["frequency(1)", "damping(1)"]

[sweep.over]
load_inertia = { from = "1e-3 kg m^2", to = "6e-3 kg m^2", count = 11 }

[rank]
outputs = ["max(shaft)", "last(load_position)"]
samples = 64

# From a measured frequency response alone, without a start: see [data.taps] above.
# [identify]
# procedure = "two_mass"
# data = "taps"
# motor = "phi_motor"           # measured names
# load = "phi_load"
# excitation = "i"
"""
