"""A loop whose friction is a straight line, for linear analysis.

At rest a sharp friction blocks an axis, and its slope there is nothing but the width by which it was smoothed. A linear
model is therefore one of an axis that moves, or of one whose friction is left to its viscous part.
"""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, as_scalar
from twin.control.closed_loop import ClosedLoop
from twin.drives.friction_slope import friction_slope
from twin.laws import AbstractFriction, AbstractStaticFriction, ViscousFriction


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

    laws = _laws(loop)
    if not laws:
        return loop
    if len(laws) > 1:
        raise InputError(
            f"The plant has {len(laws)} friction laws ({', '.join(type(law).__name__ for law in laws)}), which one "
            "speed does not describe. Replace each by a FrictionSlope, or give the operating state instead of a speed."
        )
    straight = FrictionSlope(friction_slope("friction of the plant", laws[0], speed))
    plant = jax.tree.map(lambda x: straight if _is_law(x) else x, loop.plant, is_leaf=_is_law)
    return ClosedLoop(plant, loop.controller)


def at_operating_point(loop: ClosedLoop, speed: Float[ArrayLike, ""] | None, state: Any) -> ClosedLoop:
    """The loop as it is linearised: with the friction of a speed, or with its own at a state.

    Args:
        loop: plant and controller.
        speed: operating speed [m/s or rad/s], or None.
        state: operating state, or None.

    Raises:
        InputError: neither, and a friction whose slope depends on the speed; otherwise as `with_friction_at`.
    """
    if speed is not None:
        return with_friction_at(loop, speed)
    curved = [law for law in _laws(loop) if not isinstance(law, FrictionSlope | ViscousFriction)]
    if curved and state is None:
        raise InputError(
            f"The plant's friction is a {type(curved[0]).__name__}, whose slope depends on the speed, and no operating "
            "point is given. Give friction_speed, a speed at which the axis moves; or state, which is "
            "loop.initial_state() for an axis at rest, where a sharp friction blocks it."
        )
    return loop


def _laws(loop: ClosedLoop) -> list[AbstractFriction]:
    return [law for law in jax.tree.leaves(loop.plant, is_leaf=_is_law) if _is_law(law)]


def _is_law(x: object) -> bool:
    return isinstance(x, AbstractFriction)
