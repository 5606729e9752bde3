"""Joints: springs, viscous and hysteretic dampers between places of a machine, or between a place and the ground."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
from jaxtyping import Array, Float

from twin._checks import InputError, as_scalar, finite, is_concrete, not_negative
from twin.structure.directions import DIRECTIONS, Directions


class Attachment(eqx.Module):
    """A place on a component: a node, or a point on a rail that travels with the axis."""

    component: str = eqx.field(static=True)
    """Name of the component."""
    node: str | None = eqx.field(static=True, default=None)
    """Name of the node; None for a point on a rail."""
    rail: str | None = eqx.field(static=True, default=None)
    """Name of the rail; None for a node."""
    offset: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Coordinate on the rail at axis position zero [m]: coordinate = offset + position."""
    name: str | None = eqx.field(static=True, default=None)
    """Name of the travelling point, under which it is an output of the machine as a node is; None for no output."""

    def __check_init__(self):
        if (self.node is None) == (self.rail is None):
            raise InputError(
                f"An attachment to {self.component!r} takes a node or a rail, but has node {self.node!r} and rail "
                f"{self.rail!r}. Give one of the two."
            )
        if self.name is not None and self.rail is None:
            raise InputError(
                f"The attachment {self.name!r} is at node {self.node!r}, which has its name. Leave it out."
            )
        finite("offset", self.offset, "m")

    def __repr__(self) -> str:
        place = self.node if self.rail is None else f"rail {self.rail}"
        return f"Attachment({self.component}, {place})"


def _as_pairs(value: Any) -> Any:
    return tuple(tuple(pair) for pair in value) if isinstance(value, Sequence) else value


class Joint(eqx.Module):
    """One law at one or several places, such as four equal guide shoes.

    Each pair of places is joined by a spring, a viscous and a hysteretic damper in each direction. A pair's second
    place may be None: the ground.

    Raises:
        InputError: no pairs, a pair that is none, negative or non-finite values, an unknown direction, a value in a
            direction that is not among those used, a lead to the ground.
    """

    stiffness: Directions
    """Stiffnesses k [N/m, Nm/rad]."""
    viscous: Directions
    """Viscous dampings c [Ns/m, Nms/rad]."""
    hysteretic: Directions
    """Hysteretic dampings d [N/m, Nm/rad]."""
    pairs: tuple[tuple[Attachment, Attachment | None], ...] = eqx.field(converter=_as_pairs)
    """The places joined."""
    lead: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Lead of a screw h [m per turn], 0 for none. With it the deflection in z is z₁ - z₂ - h/(2π)·rz₂: the nut first,
    then the screw."""
    directions: tuple[str, ...] = eqx.field(static=True, default=DIRECTIONS)
    """Directions in use; the fewer, the smaller the matrices."""

    def __init__(
        self,
        pairs: Sequence[tuple[Attachment, Attachment | None]],
        stiffness: Directions | None = None,
        viscous: Directions | None = None,
        hysteretic: Directions | None = None,
        *,
        lead: Any = 0.0,
        directions: tuple[str, ...] = DIRECTIONS,
    ):
        self.pairs = tuple((first, second) for first, second in pairs)
        self.stiffness = Directions() if stiffness is None else stiffness
        self.viscous = Directions() if viscous is None else viscous
        self.hysteretic = Directions() if hysteretic is None else hysteretic
        self.lead = as_scalar(lead)
        self.directions = tuple(directions)

    def __check_init__(self):
        if not self.pairs:
            raise InputError("pairs must name at least one pair of places that the joint connects, but is empty.")
        for direction in self.directions:
            if direction not in DIRECTIONS:
                raise InputError(f"directions must be among {', '.join(DIRECTIONS)}, but one is {direction!r}.")
        for law in ("stiffness", "viscous", "hysteretic"):
            for direction in DIRECTIONS:
                value = getattr(getattr(self, law), direction)
                not_negative(f"{law}.{direction}", value)
                if direction not in self.directions and is_concrete(value) and value != 0:
                    raise InputError(
                        f"{law}.{direction} is {value:g}, but the joint uses only {', '.join(self.directions)}. Add "
                        f"{direction!r} to its directions."
                    )
        finite("lead", self.lead, "m")
        if is_concrete(self.lead) and self.lead != 0 and any(second is None for _, second in self.pairs):
            raise InputError(
                f"lead is {self.lead:g} m, but a pair ends on the ground. A screw needs a nut and a shaft."
            )

    def __repr__(self) -> str:
        return f"Joint({len(self.pairs)} pairs in {', '.join(self.directions)})"
