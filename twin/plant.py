"""The interface of everything that can be simulated: drives, and the closed loops built around them."""

import abc
from typing import Any

import equinox as eqx
from jaxtyping import Array, Float, PyTree


class AbstractPlant(eqx.Module):
    """A system of ordinary differential equations with named states, inputs and outputs.

    States, inputs and outputs are NamedTuples or modules, never a bare array whose columns one has to remember.
    """

    @abc.abstractmethod
    def initial_state(self) -> PyTree[Array]:
        """The state at the start of a simulation."""

    @abc.abstractmethod
    def rest_inputs(self) -> PyTree[Array]:
        """The inputs of a plant that is left alone: a NamedTuple of zeros, whose field `command` is the actuator's."""

    @abc.abstractmethod
    def vector_field(self, t: Float[Array, ""], state: PyTree[Array], inputs: PyTree[Array]) -> PyTree[Array]:
        """The time derivative of the state, in the structure of the state.

        Args:
            t: time [s].
            state: as `initial_state` returns it.
            inputs: as `rest_inputs` returns it.
        """

    @abc.abstractmethod
    def outputs(self, t: Float[Array, ""], state: PyTree[Array], inputs: PyTree[Array]) -> Any:
        """What a measurement of the plant would record, as a NamedTuple of scalars.

        A controller around the plant sees the outputs at rest inputs, that is, without direct feed-through.
        """


def told(outputs: Any, command: PyTree[Array]) -> Any:
    """Outputs of a plant behind an actuator: its `command`, if it records one, is what the actuator was told.

    Args:
        outputs: of the plant.
        command: of the actuator.
    """
    return outputs._replace(command=command) if "command" in outputs._fields else outputs
