"""Controllers, and the loops that they close around plants."""

from twin.control.closed_loop import ClosedLoop as ClosedLoop
from twin.control.closed_loop import ClosedLoopState as ClosedLoopState
from twin.control.closed_loop import SampledLoop as SampledLoop
from twin.control.controller import AbstractController as AbstractController
from twin.control.controller import AbstractSampledController as AbstractSampledController
from twin.control.delayed import DelayedPlant as DelayedPlant
from twin.control.lagged_actuator import LaggedActuator as LaggedActuator
from twin.control.position_velocity import EncoderMemory as EncoderMemory
from twin.control.position_velocity import SampledPositionVelocity as SampledPositionVelocity
