"""Inputs that drives with one actuator have in common."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float


class DriveInputs(NamedTuple):
    """Inputs of a drive with one actuator."""

    command: Float[Array, ""]
    """What the actuator is told [command unit: V, A, N or Nm; the drive's gain turns it into a force or torque]."""
    load: Float[Array, ""]
    """Force or torque that acts on the driven body from outside, positive in the direction of motion [N or Nm]."""


def no_inputs() -> DriveInputs:
    """Inputs of a drive that is left alone."""
    return DriveInputs(jnp.zeros(()), jnp.zeros(()))
