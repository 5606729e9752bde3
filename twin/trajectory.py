"""What a simulation returns."""

from typing import Any

import equinox as eqx
from jaxtyping import Array, Float, PyTree

from twin._checks import InputError


class SimulationStatus(eqx.Enumeration):
    """How a simulation ended; `SimulationStatus[status]` is a sentence on what to do."""

    successful = "The simulation succeeded."
    not_finite = (
        "The simulation became NaN or infinite: the model is unstable for these parameters, or a parameter is outside "
        "its physical range. Look at the bounds and at the sign of gains and masses."
    )
    not_accurate = (
        "The constant steps are too coarse for the tolerance that was asked for; the trajectory is given all the same. "
        "Raise `substeps`, or let `choose_substeps` find a sufficient number."
    )
    too_many_steps = (
        "The adaptive integrator used up its steps before the end. The model is stiffer than expected: raise "
        "`max_steps`, loosen the tolerance, or widen the smoothing of friction and backlash."
    )


class Trajectory(eqx.Module):
    """States and outputs over time. A run that failed holds NaN, never a plausible number; look at `status`."""

    times: Float[Array, "times"]
    """Times of the samples [s]."""
    states: PyTree[Array]
    """States at the times, in the plant's own structure with a leading time axis."""
    outputs: Any
    """Outputs at the times: a NamedTuple of arrays of shape (times,)."""
    status: SimulationStatus
    """How the run ended."""
    error_estimate: Float[Array, ""]
    """Largest estimated local error relative to the tolerance asked for; at most 1 where the run is successful. NaN
    where the integrator controls its error itself (adaptive steps)."""

    def channel(self, name: str) -> Float[Array, "times"]:
        """One output by name.

        Raises:
            InputError: if the plant has no output of that name.
        """
        if name not in self.outputs._fields:
            raise InputError(
                f"The simulated system has no output {name!r}; it has {', '.join(self.outputs._fields)}. "
                "Name one of these."
            )
        return getattr(self.outputs, name)
