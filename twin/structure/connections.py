"""The joints of a machine as rows of springs and dampers."""

from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from twin.structure.joint import Joint
from twin.structure.motions import Motions, Row, place_key


class Connections(eqx.Module):
    """One row for each direction in use of each pair of places of each joint."""

    vectors: Float[Array, "dofs rows"]
    """Deflection of each row per modal coordinate, B: the rows' deflections are Bᵀq [1/√kg, 1/(m√kg)]."""
    stiffness: Float[Array, "rows"]
    """Stiffness of each row k [N/m, Nm/rad]."""
    viscous: Float[Array, "rows"]
    """Viscous damping of each row c [Ns/m, Nms/rad]."""
    hysteretic: Float[Array, "rows"]
    """Hysteretic damping of each row d [N/m, Nm/rad]."""
    names: tuple[str, ...] = eqx.field(static=True)
    """Joint, number of the pair, direction: "guide 0 x"."""


def connect(joints: Mapping[str, Joint], motions: Motions) -> Connections:
    """The joints' rows, joint by joint in the order of their names.

    Args:
        joints: joints by name.
        motions: motions of the machine's places.
    """
    layout = [
        (name, number, direction)
        for name in sorted(joints)
        for number in range(len(joints[name].pairs))
        for direction in joints[name].directions
    ]

    def side(which: int, name: str, number: int, direction: str) -> Row:
        place = joints[name].pairs[number][which]
        return None if place is None else (place_key(name, number, which, place), direction)

    def values(law: str) -> Array:
        return _of_rows([getattr(getattr(joints[name], law), direction) for name, _, direction in layout])

    firsts = [side(0, *row) for row in layout]
    seconds = [side(1, *row) for row in layout]
    turning = [None if row is None or row[1] != "z" else (row[0], "rz") for row in seconds]
    leads = _of_rows([joints[name].lead for name, _, _ in layout]) / (2 * jnp.pi)
    vectors = motions.rows(firsts) - motions.rows(seconds) - leads[:, None] * motions.rows(turning)
    return Connections(
        vectors.T,
        values("stiffness"),
        values("viscous"),
        values("hysteretic"),
        tuple(f"{name} {number} {direction}" for name, number, direction in layout),
    )


def _of_rows(values: list[Array]) -> Float[Array, "rows"]:
    """One number for each row; those that several rows share are stacked once."""
    if not values:
        return jnp.zeros(0)
    own = {id(value): value for value in values}
    order = {key: i for i, key in enumerate(own)}
    return jnp.stack(list(own.values()))[np.asarray([order[id(value)] for value in values])]
