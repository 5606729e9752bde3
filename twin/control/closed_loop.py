"""A controller around a plant, in continuous time and sampled."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from twin._checks import above_zero, as_scalar, positive
from twin.control.controller import AbstractController, AbstractSampledController
from twin.plant import AbstractPlant
from twin.references import AbstractReference, MotionPoint


class ClosedLoopState(NamedTuple):
    """State of a closed loop."""

    plant: PyTree[Array]
    """State of the plant."""
    controller: PyTree[Array]
    """State of the controller."""


class ClosedLoop(AbstractPlant):
    """A plant and a continuous controller; itself a plant, whose input is the reference."""

    plant: AbstractPlant
    controller: AbstractController

    def initial_state(self) -> ClosedLoopState:
        return ClosedLoopState(self.plant.initial_state(), self.controller.initial_state())

    def rest_inputs(self) -> MotionPoint:
        zero = jnp.zeros(())
        return MotionPoint(zero, zero, zero)

    def vector_field(self, t: Float[Array, ""], state: Any, inputs: Any) -> ClosedLoopState:
        measurement = self.plant.outputs(t, state.plant, self.plant.rest_inputs())
        command = self.controller.command(t, state.controller, inputs, measurement)
        return ClosedLoopState(
            self.plant.vector_field(t, state.plant, _command_inputs(self.plant, command)),
            self.controller.vector_field(t, state.controller, inputs, measurement),
        )

    def outputs(self, t: Float[Array, ""], state: Any, inputs: Any) -> Any:
        measurement = self.plant.outputs(t, state.plant, self.plant.rest_inputs())
        command = self.controller.command(t, state.controller, inputs, measurement)
        return self.plant.outputs(t, state.plant, _command_inputs(self.plant, command))


class SampledLoop(eqx.Module):
    """A plant and a controller that acts once per `period`, its command held in between.

    Not a plant: what happens at a tick is not a differential equation. `simulate` knows how to run it.
    """

    plant: AbstractPlant
    controller: AbstractSampledController
    period: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Time between ticks T [s]."""
    injection: AbstractReference | None = None
    """Added to the plant's inputs, in their structure: test pulses behind the controller, process forces."""
    command_limit: Float[Array, ""] = eqx.field(converter=as_scalar, default=float("inf"))
    """Largest command that the amplifier takes, what is injected included [command unit]."""

    def __check_init__(self):
        positive("period of the sampled controller", self.period, "s")
        above_zero("command_limit", self.command_limit)

    def measure(self, t: Float[Array, ""], plant_state: PyTree[Array]) -> Any:
        """What the controller sees: the plant's outputs without direct feed-through."""
        return self.plant.outputs(t, plant_state, self.plant.rest_inputs())

    def inputs(self, command: PyTree[Array], injected: PyTree[Array] | None) -> PyTree[Array]:
        """The plant's inputs: the command and what is added behind the controller, within the amplifier's limit."""
        inputs = _command_inputs(self.plant, command)
        if injected is not None:
            inputs = jax.tree.map(jnp.add, inputs, injected)
        limited = jax.tree.map(lambda u: jnp.clip(u, -self.command_limit, self.command_limit), inputs.command)
        return inputs._replace(command=limited)


def _command_inputs(plant: AbstractPlant, command: PyTree[Array]) -> PyTree[Array]:
    return plant.rest_inputs()._replace(command=command)
