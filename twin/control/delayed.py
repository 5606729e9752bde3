"""A plant behind a dead time: the current loop, the bus and the sampling of a drive, seen from outside."""

import equinox as eqx
from jaxtyping import Array, Float, PyTree

from twin._checks import as_scalar, finite
from twin.linear import StateSpace, linearise
from twin.plant import AbstractPlant


class DelayedPlant(eqx.Module):
    """A plant whose inputs arrive late by a dead time, for comparison with measured frequency responses.

    It is no plant itself: the state of a dead time is not finite.
    """

    plant: AbstractPlant
    """What follows the dead time."""
    delay: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Dead time τ [s]; negative where the recorded inputs lag behind the recorded outputs."""

    def __check_init__(self):
        finite("delay", self.delay, "s")

    def linearise(
        self,
        state: PyTree[Array] | None = None,
        inputs: PyTree[Array] | None = None,
        *,
        outputs: tuple[str, ...] | None = None,
    ) -> StateSpace:
        """The plant near an operating point, behind the dead time.

        Args:
            state: operating point; the plant's initial state if not given.
            inputs: operating inputs; the rest inputs if not given.
            outputs: names of the outputs to keep; all if not given.

        Raises:
            InputError: 64-bit mode off, or an output that the plant does not have.
        """
        return linearise(self.plant, state, inputs, outputs=outputs, delay=self.delay)
