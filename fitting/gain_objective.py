"""What a positioning costs: error, energy and time weighed against fixed references, as a function of the cycle."""

import dataclasses
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from fitting.cycle_run import CycleRun
from twin._checks import InputError, as_scalar, not_negative, positive
from twin.laws import smooth_abs
from twin.performance import PositioningCycle, PositioningPerformance


class GainObjective(eqx.Module):
    """C = w_e·|err|/err_max - w_E·ener_min/ener - w_τ·τ_min/τ with fixed references: smaller is better.

    The references are those of an earlier sweep, so that every design is scored on one scale. |err| is √(err² + w²)
    with the width w, as the best gain often lies where err changes its sign and |err| has a kink: derivatives are then
    finite and the cost at the kink is w/err_max above the sharp one.

    Raises:
        InputError: a reference or width that is not positive, a weight that is negative.

    Source: Mauro et al., eq. 22, where the weights are one.
    """

    worst_error: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Largest static error err_max [m]."""
    least_energy: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Smallest energy of a cycle ener_min [J]."""
    least_time: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Shortest response time τ_min [s]."""
    width: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Error over which |err| is rounded off w [m]; a hundredth of err_max is a good choice."""
    error_weight: Float[Array, ""] = eqx.field(converter=as_scalar, default=1.0)
    """Weight of the error w_e [-]."""
    energy_weight: Float[Array, ""] = eqx.field(converter=as_scalar, default=1.0)
    """Weight of the energy w_E [-]."""
    time_weight: Float[Array, ""] = eqx.field(converter=as_scalar, default=1.0)
    """Weight of the response time w_τ [-]."""
    share: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.99)
    """Share of the travel that ends the response time [-]."""

    def __check_init__(self):
        positive("worst_error", self.worst_error, "m")
        positive("least_energy", self.least_energy, "J")
        positive("least_time", self.least_time, "s")
        positive("width of the error", self.width, "m")
        positive("share", self.share)
        for name in ("error_weight", "energy_weight", "time_weight"):
            not_negative(name, getattr(self, name))

    @staticmethod
    def of_sweep(
        error: Float[ArrayLike, "designs"],
        energy: Float[ArrayLike, "designs"],
        time: Float[ArrayLike, "designs"],
        *,
        relative_width: float = 0.01,
    ) -> "GainObjective":
        """The objective with the references of a sweep; designs that failed do not count.

        Args:
            error: static errors (designs,) [m].
            energy: energies (designs,) [J].
            time: response times (designs,) [s].
            relative_width: width of |err| as a share of the largest error [-].

        Raises:
            InputError: no design with all three measures, and as the objective itself.
        """
        err, ener, tau = (jnp.asarray(values) for values in (error, energy, time))
        known = jnp.isfinite(err) & jnp.isfinite(ener) & jnp.isfinite(tau)
        if not bool(jnp.any(known)):
            raise InputError(
                "No design of the sweep has error, energy and time. Sweep gains whose simulation succeeds."
            )
        worst = jnp.max(jnp.abs(err[known]))
        return GainObjective(worst, jnp.min(ener[known]), jnp.min(tau[known]), relative_width * worst)

    def measures(self, cycle: PositioningCycle | CycleRun) -> PositioningPerformance:
        """Error, energy and time of a cycle.

        Args:
            cycle: the cycle, or its run.
        """
        return CycleRun.of(cycle).performance(self.share)

    def cost(self, measures: PositioningPerformance) -> Float[Array, "*designs"]:
        """Cost of measures, with |err| rounded off.

        Args:
            measures: error [m], energy [J] and time [s] of one design or of many.
        """
        return self._weighed(smooth_abs(measures.error, self.width), measures)

    def sharp_cost(self, measures: PositioningPerformance) -> Float[Array | np.ndarray, "*designs"]:
        """Cost of measures as eq. 22 prints it, with the kink of |err|.

        Args:
            measures: error [m], energy [J] and time [s] of one design or of many.
        """
        return self._weighed(abs(measures.error), measures)

    def reweighed(self, error: ArrayLike, energy: ArrayLike, time: ArrayLike) -> "GainObjective":
        """The same objective with other weights.

        Args:
            error: weight of the error [-].
            energy: weight of the energy [-].
            time: weight of the response time [-].
        """
        return dataclasses.replace(self, error_weight=error, energy_weight=energy, time_weight=time)

    def __call__(self, cycle: PositioningCycle | CycleRun) -> Float[Array, ""]:
        return self.cost(self.measures(cycle))

    # Plain arithmetic: a search outside of compiled code holds NumPy arrays in objective and measures.
    def _weighed(self, size: Any, measures: PositioningPerformance) -> Any:
        return (
            self.error_weight * size / self.worst_error  # eq. 22
            - self.energy_weight * self.least_energy / measures.energy
            - self.time_weight * self.least_time / measures.time
        )
