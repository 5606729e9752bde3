"""Table 1 of Mauro et al. as evidence about the axis behind it."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.identification.mauro_table import OPTIMAL_GAIN, REPEATED_GAIN, MauroTable, mauro_table
from fitting.identification.mauro_twin import TableTwin
from fitting.residuals.residual import AbstractResidual
from twin._checks import as_array
from twin.io.units import to_si
from twin.performance import PositioningPerformance, cycle_performance


class ColumnErrors(NamedTuple):
    """How far the twin may be, or is, from the three columns of the table."""

    time: float
    """Response time, relative [-]."""
    energy: float
    """Energy, relative [-]."""
    error: float
    """Static error [m]."""


DEVIATIONS = ColumnErrors(time=0.0015, energy=0.007, error=12e-6)
"""What the three columns are weighted by."""


class TableResidual(AbstractResidual):
    """(simulated - printed) / deviation of error, energy and response time, row by row.

    The table prints the magnitude of the error. It falls to nearly nothing at k_v = 2725 and rises again, as of a
    quantity that passes through zero: beyond that gain it is taken to be negative. Time and energy of the row that
    repeats another do not count.
    """

    gain: Float[Array, " rows"] = eqx.field(converter=as_array)
    """Position gain of the rows k_v [1/s]."""
    error: Float[Array, " rows"] = eqx.field(converter=as_array)
    """Static error, with its sign [m]."""
    energy: Float[Array, " rows"] = eqx.field(converter=as_array)
    """Energy per cycle [J]."""
    time: Float[Array, " rows"] = eqx.field(converter=as_array)
    """Response time [s]."""
    counted: Float[Array, " rows"] = eqx.field(converter=as_array)
    """One where time and energy count, zero where not."""
    step: float = eqx.field(static=True, default=2e-4)
    """Length of the integration steps [s]."""
    rigid: bool = eqx.field(static=True, default=True)
    """One inertia instead of six degrees of freedom."""

    @staticmethod
    def of(table: MauroTable | None = None, *, step: float = 2e-4, rigid: bool = True) -> "TableResidual":
        """The residual of a table in its printed units.

        Args:
            table: Table 1, if not given.
            step: length of the integration steps [s].
            rigid: one inertia instead of six degrees of freedom.
        """
        table = mauro_table() if table is None else table
        return TableResidual(
            gain=to_si(table.gain, "1/min", "1/s"),
            error=1e-6 * np.where(table.gain > OPTIMAL_GAIN, -table.error, table.error),
            energy=1e3 * table.energy,
            time=table.time,
            counted=np.where(table.gain == REPEATED_GAIN, 0.0, 1.0),
            step=step,
            rigid=rigid,
        )

    def performance(self, twin: TableTwin) -> PositioningPerformance:
        """Error, energy and response time of the rows, each (rows,) [m, J, s].

        Args:
            twin: the axis.
        """

        def one(gain: Array) -> PositioningPerformance:
            return cycle_performance(twin.cycle(gain, rigid=self.rigid, step=self.step))

        return jax.vmap(one)(self.gain)

    def __call__(self, model: TableTwin) -> Float[Array, "residuals"]:
        found = self.performance(model)
        return jnp.concatenate(
            [
                (found.error - self.error) / DEVIATIONS.error,
                self.counted * (found.energy / self.energy - 1) / DEVIATIONS.energy,
                self.counted * (found.time / self.time - 1) / DEVIATIONS.time,
            ]
        )
