"""Functions for batches, in a module of their own so that workers can read them."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float
from reference_systems import SineCommand, viscous_axis

from twin.drives import ServoAxis
from twin.paths import set_leaves
from twin.simulation import simulate
from twin.stepping import AbstractStepping, AdaptiveSteps, ConstantSteps

SCALE = 2.0


def quadratic(x: Float[Array, "3"]) -> dict[str, Array]:
    """Two outputs, of which one is a vector."""
    return {"sum": SCALE * jnp.sum(x**2), "double": x * 2}


def refuses_high(x: Float[Array, "3"]) -> Array:
    """Raises where the first entry is high."""
    x = eqx.error_if(x, x[0] > 0.999, "too high")
    return jnp.sum(jnp.log(x))


def counted(x: Float[Array, "3"]) -> Array:
    """A loop whose length depends on the sample."""
    steps = jnp.round(1000 * x[0])
    return jax.lax.while_loop(lambda c: c[0] < steps, lambda c: (c[0] + 1, c[1] * 0.999 + x[1]), (0.0, x[2]))[1]


class Line(eqx.Module):
    """A module whose arrays are not part of the program."""

    slope: Array

    def __call__(self, x: Float[Array, "3"]) -> Array:
        return self.slope * x[0]


class Move(eqx.Module):
    """Position and highest speed of an axis that is pushed for a second."""

    axis: ServoAxis
    stepping: AbstractStepping

    def __call__(self, sample: dict[str, Array]) -> dict[str, Array]:
        axis = set_leaves(self.axis, {"mass": sample["mass"], "friction.viscous": sample["viscous"]})
        found = simulate(axis, SineCommand(20.0, 3.0), jnp.linspace(0.0, 1.0, 21), stepping=self.stepping)
        return {"position": found.outputs.position[-1], "highest": jnp.max(jnp.abs(found.outputs.velocity))}


def move(adaptive: bool) -> Move:
    """The move with steps of one kind."""
    return Move(viscous_axis(), AdaptiveSteps(rtol=1e-6, atol=1e-9) if adaptive else ConstantSteps(substeps=8))
