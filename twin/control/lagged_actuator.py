"""An actuator that follows its command with a lag: a closed current loop, seen from outside."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
from jaxtyping import Array, Float, PyTree

from twin._checks import as_scalar, finite, positive
from twin.plant import AbstractPlant, told


class LaggedActuatorState(NamedTuple):
    """State of a plant with a lagged actuator."""

    plant: PyTree[Array]
    """State of the plant."""
    actual: PyTree[Array]
    """What the actuator does now [command unit]."""


class LaggedActuator(AbstractPlant):
    """τ·u̇ = command - u: the plant receives u. A first-order stand-in for a current loop of bandwidth 1/(2πτ).

    The outputs are the plant's, but for `command`, which stays what the controller asked for: that is what drives
    record.
    """

    plant: AbstractPlant
    """Plant behind the actuator."""
    time_constant: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Time constant τ [s]."""
    initial_command: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """What the actuator does at the start [command unit]."""

    def __check_init__(self):
        positive("time_constant of the actuator", self.time_constant, "s")
        finite("initial_command", self.initial_command)

    def initial_state(self) -> LaggedActuatorState:
        actual = jax.tree.map(lambda zero: zero + self.initial_command, self.plant.rest_inputs().command)
        return LaggedActuatorState(self.plant.initial_state(), actual)

    def rest_inputs(self) -> Any:
        return self.plant.rest_inputs()

    def vector_field(self, t: Float[Array, ""], state: Any, inputs: Any) -> LaggedActuatorState:
        lag = jax.tree.map(lambda wanted, actual: (wanted - actual) / self.time_constant, inputs.command, state.actual)
        return LaggedActuatorState(self.plant.vector_field(t, state.plant, self._behind(state, inputs)), lag)

    def outputs(self, t: Float[Array, ""], state: Any, inputs: Any) -> Any:
        return told(self.plant.outputs(t, state.plant, self._behind(state, inputs)), inputs.command)

    def _behind(self, state: Any, inputs: Any) -> Any:
        return inputs._replace(command=state.actual)
