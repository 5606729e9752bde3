"""A short positioning cycle that is simulated in a millisecond, for the tests of designs."""

import numpy as np

from fitting.gain_objective import GainObjective
from twin.control import ClosedLoop, PositionVelocityPI
from twin.drives import DcMotor, RigidScrewAxis
from twin.laws import DahlFriction
from twin.parameters import Parameter, ParameterSpace
from twin.performance import PositioningCycle
from twin.references import JerkLimitedMove

GAIN = "loop.controller.position_gain"
AXIS = RigidScrewAxis(DcMotor(0.35, 1e-3, 1.5, 1.5), 0.011, 0.02, DahlFriction(1.2, 0.01, 0.02))
CONTROL = PositionVelocityPI(20.0, 0.6, 10.0, 0.02, 0.8)
MOVE = JerkLimitedMove(0.02, 0.3, 6.0, 300.0)
CYCLE = PositioningCycle.create(ClosedLoop(AXIS, CONTROL), MOVE, dwell=0.1, step=2e-4)
# References of a sweep of the gain from 8 to 120 1/s, rounded.
OBJECTIVE = GainObjective(3.3e-3, 14.8, 0.125, 3.3e-5)
ONE = ParameterSpace([Parameter(GAIN, "1/s", 10.0, 120.0, scale="log")])
GAINS = ParameterSpace(
    [
        *ONE.parameters,
        Parameter("loop.controller.velocity_gain", "Vs/rad", 0.1, 3.0, scale="log"),
        Parameter("loop.controller.feedforward", "-", 0.0, 1.0),
        Parameter("move.acceleration_limit", "m/s²", 4.0, 6.5, scale="log"),
    ]
)


def sharp_peak(cycle, channel):
    return float(np.max(np.abs(cycle.simulate().channel(channel))))
