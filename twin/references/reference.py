"""The interface of references, and the set value of a motion."""

import abc
from typing import Any, NamedTuple

import equinox as eqx
from jaxtyping import Array, ArrayLike, Float


class MotionPoint(NamedTuple):
    """Set value of a motion at one time."""

    position: Float[Array, ""]
    """Position [m or rad]."""
    velocity: Float[Array, ""]
    """Velocity [m/s or rad/s]."""
    acceleration: Float[Array, ""]
    """Acceleration [m/s² or rad/s²]."""


class AbstractReference(eqx.Module):
    """What is fed to a plant as a function of time; for a closed loop, its set value.

    The values are continuous in time; where a derivative jumps, `switching_times` says so.
    """

    @abc.abstractmethod
    def __call__(self, t: Float[ArrayLike, ""]) -> Any:
        """The plant's inputs at a time; for a closed loop a `MotionPoint`.

        Args:
            t: time [s].
        """

    @abc.abstractmethod
    def switching_times(self) -> Float[Array, " switches"]:
        """Times at which a derivative of what is fed to the plant jumps, never decreasing, shape (switches,) [s].

        The integrator is told of them: it places steps there, and derivatives with respect to what moves a switching
        time come out right.
        """
