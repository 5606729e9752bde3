"""The joints of a machine as rows of springs and dampers."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from twin.structure.component import Component
from twin.structure.directions import DIRECTIONS
from twin.structure.joint import Joint
from twin.structure.point_rows import point_rows


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


def connect(components: dict[str, Component], joints: dict[str, Joint], position: Float[ArrayLike, ""]) -> Connections:
    """The joints at an axis position, joint by joint in the order of their names.

    Args:
        components: components by name.
        joints: joints by name.
        position: axis position [m].

    Returns:
        The rows.

    Raises:
        InputError: a point off its rail.
    """
    layout = [
        (name, number, direction)
        for name in sorted(joints)
        for number in range(len(joints[name].pairs))
        for direction in joints[name].directions
    ]
    pairs = [(name, number) for name in sorted(joints) for number in range(len(joints[name].pairs))]
    firsts = [joints[name].pairs[number][0] for name, number in pairs]
    seconds = [(i, joints[name].pairs[number][1]) for i, (name, number) in enumerate(pairs)]
    places = firsts + [second for _, second in seconds if second is not None]
    rows = point_rows(components, places, position)

    grounded = np.asarray([second is None for _, second in seconds])
    # A pair on the ground takes its first place as second, to be struck out below.
    partner = np.where(grounded, np.arange(len(pairs)), len(pairs) - 1 + np.cumsum(~grounded))
    pair = np.asarray([pairs.index((name, number)) for name, number, _ in layout], dtype=int)
    direction = np.asarray([DIRECTIONS.index(direction) for _, _, direction in layout], dtype=int)
    second = jnp.where(grounded[pair][:, None], 0.0, rows[partner[pair], direction])
    deflection = rows[pair, direction] - second

    axial = np.flatnonzero((direction == DIRECTIONS.index("z")) & ~grounded[pair])
    leads = jnp.stack([joints[name].lead for name, _, _ in layout])[axial]
    turning = rows[partner[pair[axial]], DIRECTIONS.index("rz")]
    deflection = deflection.at[axial].add(-leads[:, None] / (2 * jnp.pi) * turning)
    return Connections(
        deflection.T,
        *(_values(joints, law, layout) for law in ("stiffness", "viscous", "hysteretic")),
        tuple(f"{name} {number} {direction}" for name, number, direction in layout),
    )


def _values(joints: dict[str, Joint], law: str, layout: list[tuple[str, int, str]]) -> Float[Array, "rows"]:
    laws = {name: getattr(joint, law) for name, joint in joints.items()}
    own = list(dict.fromkeys((name, direction) for name, _, direction in layout))
    values = jnp.stack([getattr(laws[name], direction) for name, direction in own])
    return values[np.asarray([own.index((name, direction)) for name, _, direction in layout], dtype=int)]
