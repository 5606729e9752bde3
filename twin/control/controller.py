"""The interfaces of controllers, continuous and sampled."""

import abc
from typing import Any

import equinox as eqx
from jaxtyping import Array, Float, PyTree


class AbstractController(eqx.Module):
    """A controller in continuous time."""

    @abc.abstractmethod
    def initial_state(self) -> PyTree[Array]:
        """State of the controller at the start (integrators, filters)."""

    @abc.abstractmethod
    def vector_field(
        self, t: Float[Array, ""], state: PyTree[Array], reference: Any, measurement: Any
    ) -> PyTree[Array]:
        """Time derivative of the controller's state."""

    @abc.abstractmethod
    def command(self, t: Float[Array, ""], state: PyTree[Array], reference: Any, measurement: Any) -> PyTree[Array]:
        """What the actuator is told: the `command` field of the plant's inputs."""


class AbstractSampledController(eqx.Module):
    """A controller that computes once per tick; its command is held until the next."""

    @abc.abstractmethod
    def initial_state(self, measurement: Any, period: Float[Array, ""]) -> PyTree[Array]:
        """Memory before the first tick, given what the controller measures there and the time between ticks [s]."""

    @abc.abstractmethod
    def update(
        self, state: PyTree[Array], reference: Any, measurement: Any, period: Float[Array, ""]
    ) -> tuple[PyTree[Array], PyTree[Array]]:
        """One tick.

        Args:
            state: memory after the previous tick.
            reference: the reference at this tick.
            measurement: the plant's outputs at this tick.
            period: time between ticks [s].

        Returns:
            The memory after this tick, and the command: the `command` field of the plant's inputs.
        """
