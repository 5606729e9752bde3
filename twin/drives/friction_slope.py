"""The slope of a friction law over the speed, for linear models."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError
from twin.laws import AbstractFriction


def friction_slope(name: str, law: AbstractFriction, velocity: Float[ArrayLike, ""]) -> Float[Array, ""]:
    """Slope of the friction over the speed, at a speed [Ns/m or Nms/rad].

    Args:
        name: of the law in its drive, for the error.
        law: friction law.
        velocity: speed [m/s or rad/s].

    Raises:
        InputError: if the law has memory: its force has no slope over the speed alone.
    """
    memory = law.initial_state()
    if jax.tree.leaves(memory):
        raise InputError(
            f"{name} is {type(law).__name__}, a law with memory, which has no slope over the speed alone. "
            "Use twin.linear.linearise, which keeps its state."
        )
    at = jnp.asarray(velocity, dtype=jnp.float64)
    return jax.jvp(lambda v: law.force(memory, v, 0.0), (at,), (jnp.ones_like(at),))[1]
