"""A machine: components, joints and lumped masses, assembled at an axis position."""

from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, as_scalar, finite, is_concrete
from twin.linear import SecondOrder
from twin.structure._check_machine import check_machine
from twin.structure.component import Component
from twin.structure.connections import Connections, connect
from twin.structure.directions import DIRECTIONS
from twin.structure.joint import Joint
from twin.structure.lumped_mass import LumpedMass
from twin.structure.motions import Motions, Row


class Machine(eqx.Module):
    """Components coupled by joints, in the modal coordinates of all components stacked in the order of their names.

    Raises:
        InputError: an attachment to an unknown component, node or rail, or in a direction that the component does not
            know; two nodes of one name; a name with a dot, which no parameter path could reach.
    """

    components: dict[str, Component]
    """Components by name."""
    joints: dict[str, Joint]
    """Joints by name."""
    masses: dict[str, LumpedMass]
    """Lumped masses by name."""

    def __init__(
        self,
        components: Mapping[str, Component],
        joints: Mapping[str, Joint] | None = None,
        masses: Mapping[str, LumpedMass] | None = None,
    ):
        self.components = dict(components)
        self.joints = dict(joints or {})
        self.masses = dict(masses or {})

    def __check_init__(self):
        check_machine(self.components, self.joints, self.masses)

    def __repr__(self) -> str:
        modes = sum(c.eigenvalues.shape[-1] for c in self.components.values())
        return (
            f"Machine(components {', '.join(sorted(self.components))}: {modes} modes; {len(self.joints)} joints, "
            f"{len(self.masses)} lumped masses)"
        )

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names "node direction" of what can be measured or excited: at the nodes, then at named points on rails."""
        return tuple(f"{name} {direction}" for name in _nodes(self) for direction in DIRECTIONS)

    def second_order(
        self,
        position: Float[ArrayLike, ""] = 0.0,
        *,
        inputs: tuple[str, ...] | None = None,
        outputs: tuple[str, ...] | None = None,
    ) -> SecondOrder:
        """The machine at an axis position; differentiable in every parameter and in the position.

        With the rows B of the joints' deflections: M = I + lumped masses, C = B·diag(c)·Bᵀ, D = diag(ηλ) +
        B·diag(d)·Bᵀ, K = diag(λ) + B·diag(k)·Bᵀ.

        Args:
            position: axis position [m].
            inputs: names "node direction" of the forces wanted; all if not given.
            outputs: names "node direction" of the motions wanted; all if not given.

        Returns:
            The system in modal coordinates; NaN where a traced position lies off a rail.

        Raises:
            InputError: 64-bit mode off, a position off a rail or not finite, an unknown input or output.
        """
        _check_position(self, position)
        nodes, everything = _nodes(self), self.outputs
        excited = everything if inputs is None else tuple(inputs)
        measured = everything if outputs is None else tuple(outputs)
        matrices = _matrices(self, as_scalar(position), _places(nodes, excited), _places(nodes, measured))
        return SecondOrder(*matrices, inputs=excited, outputs=measured)

    def connections(self, position: Float[ArrayLike, ""] = 0.0) -> Connections:
        """The joints' springs and dampers at an axis position, in the coordinates of `second_order`.

        Args:
            position: axis position [m].

        Raises:
            InputError: a position off a rail.
        """
        _check_position(self, position)
        return _connections(self, as_scalar(position))


# Compiled as one piece: operation by operation, outside of compiled code, a machine takes a hundred times longer.
@eqx.filter_jit
def _connections(machine: Machine, position: Float[Array, ""]) -> Connections:
    return connect(machine.joints, Motions(machine.components, machine.joints, position))


@eqx.filter_jit
def _matrices(
    machine: Machine, position: Float[Array, ""], excited: tuple[Row, ...], measured: tuple[Row, ...]
) -> tuple[Array, ...]:
    """M, C, D, K, input and output map."""
    motions = Motions(machine.components, machine.joints, position)
    joined = connect(machine.joints, motions)
    parts = [machine.components[name] for name in sorted(machine.components)]
    own = jnp.concatenate([part.own_eigenvalues for part in parts])
    lost = jnp.concatenate([part.loss_factor * part.own_eigenvalues for part in parts])

    def coupled(diagonal: Array, vectors: Array, values: Array) -> Array:
        return jnp.diag(diagonal) + (vectors * values) @ vectors.T

    lumps = [machine.masses[name] for name in sorted(machine.masses)]
    moved = motions.rows([(lump.node, direction) for lump in lumps for direction in DIRECTIONS]).T
    weights = [v for m in lumps for v in (m.mass, m.mass, m.mass, m.inertia_x, m.inertia_y, m.inertia_z)]
    return (
        coupled(jnp.ones_like(own), moved, jnp.stack(weights) if weights else jnp.zeros(0)),
        coupled(jnp.zeros_like(own), joined.vectors, joined.viscous),
        coupled(lost, joined.vectors, joined.hysteretic),
        coupled(own, joined.vectors, joined.stiffness),
        motions.rows(excited).T,
        motions.rows(measured),
    )


def _check_position(machine: Machine, position: ArrayLike) -> None:
    finite("position", position, "m")
    for joint in machine.joints.values():
        for place in (place for pair in joint.pairs for place in pair):
            if place is not None and place.rail is not None and is_concrete(position):
                rail = machine.components[place.component].rails[place.rail]
                rail.check(place.offset + position, f"rail {place.rail!r} of component {place.component!r}")


def _nodes(machine: Machine) -> tuple[str, ...]:
    """Names of the nodes, then of the named points on rails."""
    nodes = [node for name in sorted(machine.components) for node in machine.components[name].nodes]
    pairs = [pair for name in sorted(machine.joints) for pair in machine.joints[name].pairs]
    return (*nodes, *(place.name for pair in pairs for place in pair if place is not None and place.name))


def _places(nodes: tuple[str, ...], names: tuple[str, ...]) -> tuple[Row, ...]:
    places = []
    for name in names:
        node, _, direction = name.rpartition(" ")
        if node not in nodes or direction not in DIRECTIONS:
            raise InputError(
                f"The machine has no node and direction {name!r}. Nodes: {', '.join(nodes)}; directions: "
                f"{', '.join(DIRECTIONS)}; written as '{(*nodes, 'N1')[0]} x'."
            )
        places.append((node, direction))
    return tuple(places)
