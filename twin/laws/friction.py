"""The interfaces of friction laws, with and without memory."""

import abc
from typing import Any

import equinox as eqx
from jaxtyping import Array, ArrayLike, Float, PyTree


class AbstractFriction(eqx.Module):
    """A friction force as a function of speed, of an internal state, and where it matters of position.

    The force is positive for positive speed; it enters the equation of motion as -force. A law for linear motion has
    speeds in m/s and forces in N; for rotation, rad/s and Nm.
    """

    @abc.abstractmethod
    def initial_state(self) -> PyTree[Array]:
        """The internal state at rest and without load."""

    @abc.abstractmethod
    def rate(self, state: Any, velocity: Float[ArrayLike, "*batch"]) -> PyTree[Array]:
        """Time derivative of the internal state.

        Args:
            state: internal state, as `initial_state` returns it.
            velocity: speed [m/s or rad/s].

        Returns:
            The derivative in the structure of the state.
        """

    @abc.abstractmethod
    def force(
        self, state: Any, velocity: Float[ArrayLike, "*batch"], position: Float[ArrayLike, "*batch"]
    ) -> Float[Array, "*batch"]:
        """Friction force, positive against positive motion [N or Nm].

        Args:
            state: internal state, as `initial_state` returns it.
            velocity: speed [m/s or rad/s].
            position: position [m or rad]; most laws do not depend on it.
        """


class AbstractStaticFriction(AbstractFriction):
    """A friction force that depends on the present speed alone."""

    @abc.abstractmethod
    def __call__(self, velocity: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        """Friction force, positive against positive motion [N or Nm].

        Args:
            velocity: speed of any shape [m/s or rad/s].
        """

    def initial_state(self) -> tuple[()]:
        """No memory."""
        return ()

    def rate(self, state: Any, velocity: Float[ArrayLike, "*batch"]) -> tuple[()]:
        """No memory, no rate."""
        return ()

    def force(
        self, state: Any, velocity: Float[ArrayLike, "*batch"], position: Float[ArrayLike, "*batch"]
    ) -> Float[Array, "*batch"]:
        """The law at this speed, wherever the axis is."""
        return self(velocity)
