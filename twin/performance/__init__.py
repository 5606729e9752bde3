"""How well a drive positions: energy, time, error, overshoot, their weighing, the stability of its loop, and
the time spent at a limit."""

from twin.performance.cycle import PositioningCycle, cycle_performance
from twin.performance.energy import motoring_energy
from twin.performance.overshoot import overshoot
from twin.performance.positioning import PositioningPerformance, positioning_cost, positioning_performance
from twin.performance.response_time import response_time, settling_time
from twin.performance.saturation import limit_share, warn_at_limit
from twin.performance.stability import StabilityMargin, stability_margin
from twin.performance.static_error import StaticError, static_error

__all__ = [
    "PositioningCycle",
    "PositioningPerformance",
    "StabilityMargin",
    "StaticError",
    "cycle_performance",
    "limit_share",
    "motoring_energy",
    "overshoot",
    "positioning_cost",
    "positioning_performance",
    "response_time",
    "settling_time",
    "stability_margin",
    "static_error",
    "warn_at_limit",
]
