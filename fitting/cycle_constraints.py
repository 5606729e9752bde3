"""Limits that a positioning cycle has to keep, as constraints of a design."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from fitting.constraints import Inequality
from fitting.cycle_run import CycleRun
from twin._checks import InputError, as_array, as_scalar, increasing, positive
from twin.control import open_loop_response
from twin.performance import PositioningCycle, overshoot, stability_margin

MEASURES = {"error": "m", "energy": "J", "time": "s"}
"""What a `MeasureLimit` can limit, with units."""


class PeakLimit(eqx.Module):
    """1 - peak/limit of the magnitude of one output of the axis, such as torque or voltage.

    The peak is w·L·ln Σ(exp(y/wL) + exp(-y/wL)) over the recorded samples y, with limit L and width w: never below
    their sharp maximum and at most w·L·ln(2·samples) above, so that what holds for it holds for the samples. A peak
    between two samples is not seen.

    Raises:
        InputError: a limit or width that is not positive.
    """

    channel: str = eqx.field(static=True)
    """Name of the output."""
    limit: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Largest magnitude L, in the unit of the output."""
    width: Float[Array, ""] = eqx.field(converter=as_scalar, default=2e-3)
    """Width w as a share of the limit [-]."""

    def __check_init__(self):
        positive(f"limit of the peak {self.channel}", self.limit)
        positive("width of the peak", self.width)

    @property
    def names(self) -> tuple[str, ...]:
        """Name of the value."""
        return (f"peak {self.channel}",)

    def __call__(self, cycle: PositioningCycle | CycleRun) -> Float[Array, ""]:
        relative = CycleRun.of(cycle).channel(self.channel) / self.limit
        both = jnp.concatenate([relative, -relative]) / self.width
        return 1 - self.width * jax.nn.logsumexp(both)


class OvershootLimit(eqx.Module):
    """1 - overshoot/limit, with the smooth maximum of `twin.performance.overshoot`, which is never below the samples.

    Raises:
        InputError: a limit or width that is not positive.
    """

    limit: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Largest overshoot as a share of the travel [-], above zero."""
    width: Float[Array, ""] = eqx.field(converter=as_scalar, default=2e-2)
    """Width of the maximum over the samples as a share of the limit [-]."""

    def __check_init__(self):
        positive("limit of the overshoot", self.limit)
        positive("width of the overshoot", self.width)

    @property
    def names(self) -> tuple[str, ...]:
        """Name of the value."""
        return ("overshoot",)

    def __call__(self, cycle: PositioningCycle | CycleRun) -> Float[Array, ""]:
        run = CycleRun.of(cycle)
        beyond = overshoot(
            run.trajectory.times,
            run.channel("position"),
            run.cycle.target,
            start=run.cycle.move.start_position,
            width=self.width * self.limit,
        )
        return 1 - beyond / self.limit


class SensitivityLimit(eqx.Module):
    """1 - M_s/limit of the loop opened at the plant's command and linearised, over given frequencies.

    Linearised at rest, where a bristle friction acts as a spring, or where the axis moves fastest in the cycle. M_s is
    smoothed over frequency and never below the sharp peak. That the closed loop is stable at all, a simulation of the
    cycle shows.

    Raises:
        InputError: a limit not above 1, a width that is not positive, frequencies that do not increase, an unknown
            operating point.
    """

    limit: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Largest sensitivity peak M_s [-], above 1; 2 is usual."""
    frequency: Float[Array, "frequencies"] = eqx.field(converter=as_array)
    """Frequencies, fine where the open loop comes near -1 [Hz]."""
    width: Float[Array, ""] = eqx.field(converter=as_scalar, default=5e-3)
    """Width of the maximum over the frequencies as a share of the limit [-]."""
    at: str = eqx.field(static=True, default="moving")
    """Operating point: "moving" or "rest"."""

    def __check_init__(self):
        positive("limit of the sensitivity peak less 1", jnp.asarray(self.limit) - 1.0)
        increasing("frequency of the sensitivity", self.frequency, "Hz")
        positive("width of the sensitivity peak", self.width)
        if self.at not in ("moving", "rest"):
            raise InputError(f'at must be "moving" or "rest", but is {self.at!r}. Choose one of the two.')

    @property
    def names(self) -> tuple[str, ...]:
        """Name of the value."""
        return (f"sensitivity peak, {self.at}",)

    def __call__(self, cycle: PositioningCycle | CycleRun) -> Float[Array, ""]:
        if self.at == "moving":
            run = CycleRun.of(cycle)
            loop, (state, reference) = run.cycle.loop, run.fastest()
        else:
            loop = cycle.cycle.loop if isinstance(cycle, CycleRun) else cycle.loop
            state, reference = loop.initial_state(), None
        opened = open_loop_response(loop, self.frequency, state=state, reference=reference)
        margin = stability_margin(opened, width=self.width * self.limit)
        return 1 - margin.sensitivity_peak / self.limit


class MeasureLimit(eqx.Module):
    """1 - measure/limit of energy or response time; for the error both 1 - err/limit and 1 + err/limit.

    Raises:
        InputError: an unknown measure, a limit that is not positive.
    """

    measure: str = eqx.field(static=True)
    """"error", "energy" or "time"."""
    limit: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Largest magnitude [m, J or s]."""
    share: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.99)
    """Share of the travel that ends the response time [-]."""

    def __check_init__(self):
        if self.measure not in MEASURES:
            raise InputError(f"measure must be one of {', '.join(MEASURES)}, but is {self.measure!r}.")
        positive(f"limit of the {self.measure}", self.limit, MEASURES[self.measure])

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the values."""
        return ("error above", "error below") if self.measure == "error" else (self.measure,)

    def __call__(self, cycle: PositioningCycle | CycleRun) -> Float[Array, "values"]:
        relative = getattr(CycleRun.of(cycle).performance(self.share), self.measure) / self.limit
        return 1 - (jnp.stack([relative, -relative]) if self.measure == "error" else relative[None])


def cycle_constraints(
    *,
    torque: ArrayLike | None = None,
    voltage: ArrayLike | None = None,
    current: ArrayLike | None = None,
    overshoot: ArrayLike | None = None,
    sensitivity: ArrayLike | None = None,
    error: ArrayLike | None = None,
    energy: ArrayLike | None = None,
    time: ArrayLike | None = None,
    frequency: Float[ArrayLike, "frequencies"] | None = None,
) -> list[Inequality]:
    """Limits of a positioning cycle as constraints of a design, each scaled by its limit.

    Maxima over time and frequency are smooth ones from above, with the widths of `PeakLimit`, `OvershootLimit` and
    `SensitivityLimit`: a design that keeps them keeps the sharp ones at the recorded samples. For other widths or
    outputs write Inequality(PeakLimit(...)) and the like.

    Args:
        torque: largest torque of the motor [Nm].
        voltage: largest voltage of the motor [V].
        current: largest current of the motor [A].
        overshoot: largest overshoot as a share of the travel [-].
        sensitivity: largest sensitivity peak of the loop opened at the command, at rest and moving [-].
        error: largest magnitude of the static error [m].
        energy: largest energy of a cycle [J].
        time: longest response time [s].
        frequency: frequencies at which the sensitivity is looked at [Hz]; 200 from 1 to 1000 Hz if not given.

    Returns:
        One constraint for each limit given, two for the sensitivity.

    Raises:
        InputError: no limit at all, or one that is not positive; a sensitivity of 1 or less.
    """
    functions: list[Any] = [
        PeakLimit(channel, limit)
        for channel, limit in (("torque", torque), ("voltage", voltage), ("current", current))
        if limit is not None
    ]
    if overshoot is not None:
        functions.append(OvershootLimit(overshoot))
    if sensitivity is not None:
        f = np.geomspace(1.0, 1000.0, 200) if frequency is None else frequency
        functions += [SensitivityLimit(sensitivity, f, at=at) for at in ("moving", "rest")]
    functions += [
        MeasureLimit(name, limit)
        for name, limit in (("error", error), ("energy", energy), ("time", time))
        if limit is not None
    ]
    if not functions:
        raise InputError("Give at least one limit of the cycle, for instance torque=20.0.")
    return [Inequality(function) for function in functions]
