"""Motion of places on the components per modal coordinate of the whole machine."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from twin.structure.component import Component
from twin.structure.joint import Attachment


def point_rows(
    components: dict[str, Component], places: Sequence[Attachment], position: Float[ArrayLike, ""]
) -> Float[Array, "places 6 dofs"]:
    """Shape rows of places, in the stacked modal coordinates of all components in the order of their names.

    Args:
        components: components by name.
        places: nodes and points on rails.
        position: axis position [m].

    Returns:
        Motion in x, y, z, rx, ry, rz per modal coordinate [1/√kg, 1/(m√kg)].

    Raises:
        InputError: a point off its rail.
    """
    blocks, order = [], []
    names = sorted(components)
    sizes = [components[name].eigenvalues.shape[-1] for name in names]
    before = 0
    for name, size in zip(names, sizes, strict=True):
        block, mine = _of_component(name, components[name], places, position)
        blocks.append(jnp.pad(block, ((0, 0), (0, 0), (before, sum(sizes) - before - size))))
        order += mine
        before += size
    return jnp.concatenate(blocks)[np.argsort(np.asarray(order, dtype=int))]


def _of_component(
    name: str, component: Component, places: Sequence[Attachment], position: Float[ArrayLike, ""]
) -> tuple[Array, list[int]]:
    """Rows of the places on one component in its own coordinates, and which places they are."""
    mine = [i for i, place in enumerate(places) if place.component == name]
    order = [i for i in mine if places[i].node is not None]
    nodes = np.asarray([component.nodes.index(places[i].node or "") for i in order], dtype=int)
    rows = [component.shapes[nodes]]
    for rail_name, rail in sorted(component.rails.items()):
        on_rail = [i for i in mine if places[i].rail == rail_name]
        if on_rail:
            coordinates = jnp.stack([places[i].offset for i in on_rail]) + position
            rail.check(coordinates, f"rail {rail_name!r} of component {name!r}")
            rows.append(rail.at(coordinates))
            order += on_rail
    return jnp.concatenate(rows) / jnp.sqrt(component.density), order
