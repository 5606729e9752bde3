"""References: what a drive or a closed loop is told to do, as functions of time."""

from twin.references.constant_velocity import ConstantVelocity as ConstantVelocity
from twin.references.jerk_limited_move import JerkLimitedMove as JerkLimitedMove
from twin.references.multisine import Multisine as Multisine
from twin.references.reference import AbstractReference as AbstractReference
from twin.references.reference import MotionPoint as MotionPoint
from twin.references.sampled_record import SampledReference as SampledReference
from twin.references.sampled_signal import SampledSignal as SampledSignal
from twin.references.sine_sweep import SineSweep as SineSweep
from twin.references.sum import SumReference as SumReference
