"""How the places of a machine move with its modal coordinates."""

from collections.abc import Hashable, Mapping, Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from twin.structure.component import Component
from twin.structure.directions import DIRECTIONS
from twin.structure.joint import Attachment, Joint

Row = tuple[Hashable, str] | None
"""Key of a place and a direction; None for the ground, which does not move."""


def place_key(joint: str, pair: int, side: int, place: Attachment) -> Hashable:
    """What a joint's place is looked up by: the node's name, the travelling point's, or where in the joint it is.

    Args:
        joint: name of the joint.
        pair: number of the pair.
        side: 0 or 1.
        place: the place.
    """
    return place.node or place.name or (joint, pair, side)


class Motions:
    """Motion of every node, and of every point of a joint on a rail, per modal coordinate at one axis position.

    The modal coordinates of all components are stacked in the order of their names.
    """

    def __init__(
        self, components: Mapping[str, Component], joints: Mapping[str, Joint], position: Float[ArrayLike, ""]
    ):
        """Shapes of all places, the rails' at the axis position [m].

        Raises:
            InputError: a point off its rail.
        """
        travelling = {
            place_key(name, number, side, place): place
            for name in sorted(joints)
            for number, pair in enumerate(joints[name].pairs)
            for side, place in enumerate(pair)
            if place is not None and place.rail is not None
        }
        self._blocks: list[Array] = []
        self._numbers: list[dict[Hashable, int]] = []
        for name in sorted(components):
            component = components[name]
            numbers: dict[Hashable, int] = {node: i for i, node in enumerate(component.nodes)}
            shapes = [component.shapes]
            for rail_name, rail in sorted(component.rails.items()):
                mine = [k for k, place in travelling.items() if (place.component, place.rail) == (name, rail_name)]
                if mine:
                    coordinates = jnp.stack([travelling[key].offset for key in mine]) + position
                    rail.check(coordinates, f"rail {rail_name!r} of component {name!r}")
                    shapes.append(rail.at(coordinates))
                    numbers |= {key: len(numbers) + i for i, key in enumerate(mine)}
            self._numbers.append(numbers)
            block = jnp.concatenate(shapes) / jnp.sqrt(component.density)
            self._blocks.append(block.reshape(-1, component.eigenvalues.shape[-1]))

    def rows(self, wanted: Sequence[Row]) -> Float[Array, "rows dofs"]:
        """Motions of places in directions per modal coordinate [1/√kg, 1/(m√kg)].

        Args:
            wanted: key of the place and direction of each row; None for a row of zeros.
        """
        parts = []
        for block, numbers in zip(self._blocks, self._numbers, strict=True):
            index = np.zeros(len(wanted), dtype=np.int32)
            here = np.asarray([row is not None and row[0] in numbers for row in wanted], dtype=bool)
            if not here.any():
                parts.append(jnp.zeros((len(wanted), block.shape[1])))
                continue
            index[here] = [
                numbers[row[0]] * 6 + DIRECTIONS.index(row[1]) for row in wanted if row and row[0] in numbers
            ]
            picked = block.at[index].get(mode="promise_in_bounds")
            parts.append(picked if here.all() else jnp.where(here[:, None], picked, 0.0))
        return jnp.concatenate(parts, axis=1)
