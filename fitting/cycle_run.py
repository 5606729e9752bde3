"""A cycle together with its simulation, so that everything said about it is said of one simulation."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin.performance import PositioningCycle, PositioningPerformance, cycle_performance
from twin.trajectory import Trajectory


class CycleRun(eqx.Module):
    """A positioning cycle and its run; with `experiment=CycleRun.of` a design simulates each cycle once for its
    objective and all its limits."""

    cycle: PositioningCycle
    """The cycle."""
    trajectory: Trajectory
    """Its simulation."""

    @staticmethod
    def of(cycle: "PositioningCycle | CycleRun") -> "CycleRun":
        """The run of a cycle; one that has been made already is passed on.

        Args:
            cycle: a cycle, or its run.
        """
        return cycle if isinstance(cycle, CycleRun) else CycleRun(cycle, cycle.simulate())

    def performance(self, share: Float[ArrayLike, ""]) -> PositioningPerformance:
        """Static error, motoring energy and response time.

        Args:
            share: share of the travel that ends the response time [-].
        """
        return cycle_performance(self.cycle, share, run=self.trajectory)

    def channel(self, name: str) -> Float[Array, "times"]:
        """One output of the axis by name.

        Args:
            name: of the output.
        """
        return self.trajectory.channel(name)

    def fastest(self) -> tuple[Any, Any]:
        """State of the loop where its axis moves fastest, and what it is told there; NaN where the run failed."""
        i = jnp.argmax(jnp.abs(self.channel("velocity")))
        state = jax.tree.map(lambda rows: rows[i], self.trajectory.states)
        return state, self.cycle.move(self.trajectory.times[i])
