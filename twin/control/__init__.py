"""Controllers, and the loops that they close around plants."""

from twin.control.closed_loop import ClosedLoop as ClosedLoop
from twin.control.closed_loop import ClosedLoopState as ClosedLoopState
from twin.control.closed_loop import SampledLoop as SampledLoop
from twin.control.controller import AbstractController as AbstractController
from twin.control.controller import AbstractSampledController as AbstractSampledController
from twin.control.current_loop import CurrentLoop as CurrentLoop
from twin.control.current_loop import CurrentLoopState as CurrentLoopState
from twin.control.delayed import DelayedPlant as DelayedPlant
from twin.control.encoders import Encoders as Encoders
from twin.control.lagged_actuator import LaggedActuator as LaggedActuator
from twin.control.position_velocity import EncoderMemory as EncoderMemory
from twin.control.position_velocity import SampledPositionVelocity as SampledPositionVelocity
from twin.control.preload import CascadeGains as CascadeGains
from twin.control.preload import PreloadCascade as PreloadCascade
from twin.control.reconstruction import mesh_forces_of_motion as mesh_forces_of_motion
from twin.control.reconstruction import reconstruct_table_position as reconstruct_table_position
from twin.control.sampled_preload import SampledPreloadCascade as SampledPreloadCascade
