"""One positioning of a controlled axis: the move it is told to make, and how well it makes it."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, as_array, as_scalar, increasing, is_concrete, positive
from twin.control.closed_loop import ClosedLoop
from twin.performance.positioning import PositioningPerformance, positioning_performance
from twin.performance.saturation import warn_at_limit
from twin.references import JerkLimitedMove
from twin.simulation import simulate
from twin.stepping import AbstractStepping, ConstantSteps
from twin.trajectory import Trajectory


class PositioningCycle(eqx.Module):
    """A move of a controlled axis from rest to rest, followed by a dwell in which it comes to a standstill.

    Everything in it can be varied by path, `loop.controller.position_gain` or `move.jerk_limit` say, by `sweep`, by a
    fit or by a design.

    Raises:
        InputError: times that are no vector that increases, or do not cover the move and the window after it, or a
            window that is not positive.

    Source: the reference cycle of Mauro et al., sections 6 and 7.
    """

    loop: ClosedLoop
    """Axis and controller; the axis gives `position`, `velocity` and electrical `power`."""
    move: JerkLimitedMove
    """What the axis is told to do."""
    times: Float[Array, " times"] = eqx.field(converter=as_array)
    """Times at which the run is recorded [s]; they do not move with the move."""
    stepping: AbstractStepping
    """How time is stepped between them."""
    window: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.02)
    """Time at the end over which the static error is averaged [s]."""

    def __check_init__(self):
        if getattr(self.times, "ndim", 1) != 1:
            raise InputError(f"times of the cycle must be a vector [s], but have shape {self.times.shape}.")
        increasing("times of the cycle", self.times, "s")
        positive("window of the cycle", self.window, "s")
        if isinstance(self.move, JerkLimitedMove):
            _check_cover(self.times, self.move, self.window)

    @staticmethod
    def create(
        loop: ClosedLoop, move: JerkLimitedMove, *, dwell: float, step: float = 5e-5, record: float = 2e-3
    ) -> "PositioningCycle":
        """A cycle with constant steps.

        Args:
            loop: axis and controller.
            move: what the axis is told to do.
            dwell: time after the move, in which the axis comes to a standstill [s].
            step: length of the integration steps [s].
            record: time between recorded samples, a multiple of the step [s].

        Raises:
            InputError: a time that is not positive, a dwell shorter than the window of the static error (0.02 s), or a
                record that is no multiple of the step.
        """
        for name, value in (("dwell", dwell), ("step", step), ("record", record)):
            positive(name, value, "s")
        substeps = round(record / step)
        if substeps < 1 or abs(substeps * step - record) > 1e-9 * record:
            raise InputError(
                f"record must be a multiple of the step of {step:g} s, but is {record:g} s. Change either."
            )
        samples = int(jnp.ceil((move.start_time + move.duration() + dwell) / record)) + 1
        return PositioningCycle(loop, move, record * jnp.arange(samples), ConstantSteps(substeps=substeps))

    @property
    def target(self) -> Float[Array, ""]:
        """Where the move ends [m]."""
        return self.move.start_position + self.move.distance

    def simulate(self) -> Trajectory:
        """The run of one cycle; with a warning if the voltage is at the controller's limit all the time.

        Called for many cycles, `eqx.filter_jit` around it compiles once, without the warning.
        """
        run = simulate(self.loop, self.move, self.times, stepping=self.stepping)
        limit = getattr(self.loop.controller, "voltage_limit", None)
        voltage = getattr(run.outputs, "voltage", None)
        if limit is not None and voltage is not None and is_concrete(limit) and is_concrete(voltage):
            warn_at_limit(run.times, voltage, limit)
        return run


def _check_cover(times: ArrayLike, move: JerkLimitedMove, window: ArrayLike) -> None:
    """Raise where known times end before the move and the window after it; traced values pass."""
    needed = move.start_time + move.duration() + window
    if not (isinstance(times, Array) and is_concrete(times) and is_concrete(needed)):
        return
    if float(times[-1]) < float(needed) * (1 - 1e-9):
        raise InputError(
            f"times of the cycle end at {float(times[-1]):g} s, but the move and the window after it, over which the "
            f"static error is averaged, end at {float(needed):g} s. Lengthen times or dwell, or shorten the window."
        )


def cycle_performance(
    cycle: PositioningCycle, share: Float[ArrayLike, ""] = 0.99, *, run: Trajectory | None = None
) -> PositioningPerformance:
    """Static error, motoring energy and response time of a cycle.

    Args:
        cycle: the cycle.
        share: share of the travel that ends the response time [-].
        run: simulation of the cycle, where it has been made already.

    Returns:
        The three measures; NaN where the simulation failed or the share is never reached.
    """
    return positioning_performance(
        cycle.simulate() if run is None else run,
        cycle.target,
        window=cycle.window,
        start=cycle.move.start_position,
        share=share,
        velocity="velocity",
    )
