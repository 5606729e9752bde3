"""The first fit in Python: the record of `make_axis_csv.py`, the same axis, the same answer."""

import jax

from fitting import output_error
from twin.control import SampledLoop, SampledPositionVelocity
from twin.drives import ServoAxis
from twin.io.measurement import read_measurement
from twin.io.prepare import ChannelChoice, prepare
from twin.laws import StribeckFriction
from twin.parameters import Parameter, ParameterSpace
from twin.references import SampledReference

jax.config.update("jax_enable_x64", True)  # stiffnesses in N/m need double precision

columns = {"set": ("x_soll", "mm"), "position": ("x_ist", "mm"), "command": ("i_q", "A")}
choices = {name: ChannelChoice(column, unit) for name, (column, unit) in columns.items()}
record = prepare(read_measurement("axis.csv"), choices).record
friction = StribeckFriction(coulomb=18.0, static=26.0, stribeck_velocity=8e-3, viscous=210.0, width=5e-4, exponent=1.0)
axis = ServoAxis(mass=95.0, friction=friction, gain=60.0)
loop = SampledLoop(axis, SampledPositionVelocity(120.0, 100.0, command_limit=12.0), period=1e-3)
space = ParameterSpace(
    [
        Parameter("plant.mass", "kg", lower=10.0, upper=1000.0, scale="log"),
        Parameter("plant.friction.coulomb", "N", lower=0.0, upper=200.0),
        Parameter("plant.friction.static", "N", lower=0.0, upper=200.0),
        Parameter("plant.friction.stribeck_velocity", "m/s", lower=1e-3, upper=0.1, scale="log"),
        Parameter("plant.friction.viscous", "N s/m", lower=0.0, upper=2000.0),
        Parameter("plant.offset", "N", lower=-50.0, upper=50.0),
    ]
)
reference = SampledReference(record.times, record.channel("set"))
result = output_error(record, loop, reference, space, deviation={"position": 1e-6, "command": 0.02})
print(result)  # estimate, standard error, 95 % interval of each parameter
result.save("fit.npz")  # and FitResult.load("fit.npz", loop)
