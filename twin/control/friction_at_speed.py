"""A loop whose friction is a straight line, for linear analysis.

At rest a sharp friction blocks an axis, and its slope there is nothing but the width by which it was smoothed. A linear
model is therefore one of an axis that moves, or of one whose friction is left to its viscous part.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, as_scalar
from twin.control.closed_loop import ClosedLoop
from twin.drives.friction_slope import friction_slope
from twin.laws import AbstractFriction, AbstractStaticFriction


class FrictionSlope(AbstractStaticFriction):
    """What a friction adds near an operating speed: F = slope·v, of either sign."""

    slope: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Slope of the friction over the speed [Ns/m or Nms/rad]; negative where it falls, as below the Stribeck speed."""

    def __call__(self, velocity: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        return self.slope * jnp.asarray(velocity)


def with_friction_at(loop: ClosedLoop, speed: Float[ArrayLike, ""]) -> ClosedLoop:
    """The loop with its friction replaced by the slope that it has at a speed.

    Args:
        loop: plant and controller; the plant has one friction law, or none.
        speed: operating speed, in the unit of the law [m/s or rad/s]; of a ball screw axis that of the screw.

    Raises:
        InputError: several friction laws, or one with memory.
    """

    def is_law(x: object) -> bool:
        return isinstance(x, AbstractFriction)

    laws = [law for law in jax.tree.leaves(loop.plant, is_leaf=is_law) if is_law(law)]
    if not laws:
        return loop
    if len(laws) > 1:
        raise InputError(
            f"The plant has {len(laws)} friction laws ({', '.join(type(law).__name__ for law in laws)}), which one "
            "speed does not describe. Replace each by a FrictionSlope, or give the operating state instead of a speed."
        )
    straight = FrictionSlope(friction_slope("friction of the plant", laws[0], speed))
    plant = jax.tree.map(lambda x: straight if is_law(x) else x, loop.plant, is_leaf=is_law)
    return ClosedLoop(plant, loop.controller)
