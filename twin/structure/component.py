"""A machine component as a free-interface modal model."""

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, as_array, as_scalar, finite, not_negative, positive
from twin.structure.directions import DIRECTIONS
from twin.structure.rail import Rail


class Component(eqx.Module):
    """A free body by its natural frequencies and its mode shapes at named nodes; rigid-body modes have frequency zero.

    Density and modulus scale the whole body: λ → λ·modulus/density and shapes → shapes/√density, which is exact.

    Raises:
        InputError: shapes, positions or relative frequencies of wrong length, names given twice, negative or
            non-finite values.
    """

    eigenvalues: Float[Array, "modes"] = eqx.field(converter=as_array)
    """Squared natural frequencies λ = ω² of the free component, zero for rigid-body modes [1/s²]."""
    shapes: Float[Array, "nodes 6 modes"] = eqx.field(converter=as_array)
    """Mass-normalised shapes at the nodes, in x, y, z, rx, ry, rz [1/√kg, 1/(m√kg)]."""
    positions: Float[Array, "nodes 3"] = eqx.field(converter=as_array)
    """Coordinates x, y, z of the nodes [m]."""
    nodes: tuple[str, ...] = eqx.field(static=True)
    """Names of the nodes, unique in the machine."""
    loss_factor: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Material damping η: hysteretic damping η·diag(λ) [-]."""
    density: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Density relative to the one that the model was made with [-]."""
    modulus: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Young's modulus relative to the one that the model was made with [-]."""
    frequency: Float[Array, "modes"] = eqx.field(converter=as_array)
    """Each natural frequency relative to that of the model [-]."""
    rails: dict[str, Rail]
    """Lines along which a place of attachment travels, by name."""
    directions: tuple[str, ...] = eqx.field(static=True)
    """Directions in which the shapes are known; a joint on another one is refused."""

    def __init__(
        self,
        eigenvalues: ArrayLike | list | tuple,
        shapes: ArrayLike | list | tuple,
        positions: ArrayLike | list | tuple,
        nodes: tuple[str, ...],
        *,
        loss_factor: ArrayLike = 0.0,
        density: ArrayLike = 1.0,
        modulus: ArrayLike = 1.0,
        frequency: ArrayLike | list | tuple | None = None,
        rails: Mapping[str, Rail] | None = None,
        directions: tuple[str, ...] = DIRECTIONS,
    ):
        self.eigenvalues = as_array(eigenvalues)
        self.shapes = as_array(shapes)
        self.positions = as_array(positions)
        self.nodes = tuple(nodes)
        self.loss_factor = as_scalar(loss_factor)
        self.density = as_scalar(density)
        self.modulus = as_scalar(modulus)
        self.frequency = jnp.ones_like(self.eigenvalues) if frequency is None else as_array(frequency)
        self.rails = dict(rails or {})
        self.directions = tuple(directions)

    def __check_init__(self):
        modes, nodes = self.eigenvalues.shape[0], len(self.nodes)
        twice = {node for node in self.nodes if self.nodes.count(node) > 1}
        if twice:
            raise InputError(f"nodes must have different names, but {', '.join(sorted(twice))} occurs twice.")
        _shaped("shapes", self.shapes, (nodes, 6, modes), "(nodes, 6 directions, modes)")
        _shaped("positions", self.positions, (nodes, 3), "(nodes, 3)")
        _shaped("frequency", self.frequency, (modes,), "(modes,)")
        for name, rail in self.rails.items():
            _shaped(f"shapes of rail {name!r}", rail.shapes, (len(rail.coordinate), 6, modes), "(points, 6, modes)")
        not_negative("eigenvalues", self.eigenvalues, "1/s²")
        finite("shapes", self.shapes)
        finite("positions", self.positions, "m")
        not_negative("loss_factor", self.loss_factor)
        positive("density", self.density)
        positive("modulus", self.modulus)
        positive("frequency", self.frequency)
        for direction in self.directions:
            if direction not in DIRECTIONS:
                raise InputError(f"directions must be among {', '.join(DIRECTIONS)}, but one is {direction!r}.")

    def __repr__(self) -> str:
        rails = f", rails {', '.join(sorted(self.rails))}" if self.rails else ""
        return f"Component({self.eigenvalues.shape[-1]} modes, {len(self.nodes)} nodes{rails})"

    @property
    def own_eigenvalues(self) -> Float[Array, "modes"]:
        """Squared natural frequencies with the relative density, modulus and frequencies applied [1/s²]."""
        return self.eigenvalues * self.frequency**2 * (self.modulus / self.density)


def _shaped(name: str, value: Any, expected: tuple[int, ...], meaning: str) -> None:
    shape = getattr(value, "shape", expected)
    if shape != expected:
        raise InputError(
            f"{name} must have the shape {expected} {meaning}, but has {shape}. Check that frequencies, shapes and "
            "node names come from the same model."
        )
