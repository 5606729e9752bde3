"""Two preloaded motors on one rack."""

from twin.drives import RackPinionDrive, leipe_drive

HELP = "two motors preloaded against each other on one rack, with backlash and load-dependent stiffness and damping"


def model() -> RackPinionDrive:
    """The drive with plausible values."""
    return leipe_drive()


REST = """
# One record for each preload, the set velocity swept through the resonance. `drivetwin look FILE` lists channels.
# Copy this block for each file; torques of the motors, positions of the motors behind their gearboxes.
[data.sweep_8]
file = "sweep_8.csv"

[data.sweep_8.channels]                                     # names on the left are those of the model
position_1 = { column = "position_1", unit = "mm" }
position_2 = { column = "position_2", unit = "mm" }
table_position = { column = "table_position", unit = "mm" }
torque_1 = { column = "torque_1", unit = "N m" }
torque_2 = { column = "torque_2", unit = "N m" }

[identify]
procedure = "preloaded_drive"   # stiffness and damping over the load, without a start
preloads = { sweep_8 = "8 %" }  # of each data set, in per cent of the rated torque; three are needed, five are good
sweep_start = "1 s"             # when the sweep begins
velocity = "5 mm/s"             # on which it is put
# hold_back = ["sweep_20"]      # predicted instead of fitted
starts = 50                     # drawn about what the published procedure finds

# Without data: modes and responses at a preload.
[modes]
preload = "5 N m"
velocity = "5 mm/s"

[frf]
from = "10 Hz"
to = "300 Hz"
inputs = ["command.motor_1"]
outputs = ["table_velocity", "velocity_1"]
preload = "5 N m"
velocity = "5 mm/s"
"""
