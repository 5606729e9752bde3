"""Dotted paths into a model: `plant.friction.coulomb`, `plant.position_force.cosine.0`."""

from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from twin._checks import InputError
from twin._tree_names import leaf_name

Model = TypeVar("Model")


def get_leaf(model: Any, path: str) -> Array:
    """The number that a dotted path names.

    Args:
        model: a module.
        path: attribute names, keys and indices joined by dots.

    Returns:
        A scalar array.

    Raises:
        InputError: if there is no such path, or what is there is not a single number.
    """
    node, index = _leaf_and_index(model, path)
    value = node if index is None else node[index]
    if jnp.ndim(value) != 0:
        raise InputError(
            f"Path {path!r} names an array of shape {jnp.shape(value)}, not one number. "
            f"Add an index, as in {path + '.0'!r}."
        )
    return value


def get_part(model: Any, path: str) -> Any:
    """The part of a model that a dotted path names: a plant in a loop, or one model of several.

    Args:
        model: a module, or a dict or tuple of modules.
        path: attribute names, keys and indices joined by dots.

    Raises:
        InputError: if there is no such path.
    """
    return _walk(model, path)


def set_leaves(model: Model, values: dict[str, Any]) -> Model:
    """The model with the numbers at several dotted paths replaced.

    Args:
        model: a module.
        values: new numbers by dotted path, SI.

    Returns:
        A new model; the one given stays as it is.

    Raises:
        InputError: if there is no such path.
    """
    by_holder: dict[str, list[tuple[int | None, Any]]] = {}
    for path, value in values.items():
        _, index = _leaf_and_index(model, path)
        holder = path if index is None else path.rpartition(".")[0]
        by_holder.setdefault(holder, []).append((index, value))
    holders = list(by_holder)
    replacements = []
    for holder, changes in by_holder.items():
        old = _walk(model, holder)
        new = old
        for index, value in changes:
            new = (
                jnp.asarray(value, dtype=jnp.asarray(old).dtype)
                if index is None
                else jnp.asarray(new).at[index].set(value)
            )
        replacements.append(new)
    return eqx.tree_at(lambda m: [_walk(m, h) for h in holders], model, replacements)


def leaf_paths(model: Any) -> tuple[str, ...]:
    """Dotted paths of every number of a model."""
    found = []
    for keys, leaf in jax.tree_util.tree_leaves_with_path(model):
        if not eqx.is_inexact_array(leaf):
            continue
        path = leaf_name(keys)
        found += [path] if leaf.ndim == 0 else [f"{path}.{i}" for i in range(leaf.size)] if leaf.ndim == 1 else []
    return tuple(found)


def _leaf_and_index(model: Any, path: str) -> tuple[Any, int | None]:
    """The array that a path ends in, and the index into it if the last part is one."""
    head, _, last = path.rpartition(".")
    if head and last.lstrip("-").isdigit():
        holder = _walk(model, head)
        if isinstance(holder, jax.Array | np.ndarray):
            if not -holder.shape[0] <= int(last) < holder.shape[0] if holder.ndim else True:
                raise InputError(f"Path {path!r}: index {last} is outside the array of shape {holder.shape}.")
            return holder, int(last)
    node = _walk(model, path)
    if not isinstance(node, jax.Array | np.ndarray | np.generic | float):
        raise InputError(
            f"Path {path!r} names a {type(node).__name__}, not a number. Paths of this model's numbers: "
            f"{_listing(model)}."
        )
    return node, None


def _walk(model: Any, path: str) -> Any:
    node = model
    for part in path.split("."):
        missing = object()
        if isinstance(node, list | tuple) and part.isdigit():
            node = node[int(part)] if int(part) < len(node) else missing
        elif isinstance(node, dict):
            node = node.get(part, missing)
        else:
            node = getattr(node, part, missing)
        if node is missing:
            raise InputError(f"Unknown parameter path {path!r}: no {part!r} there. The model has: {_listing(model)}.")
    return node


def _listing(model: Any) -> str:
    paths = leaf_paths(model)
    return ", ".join(paths[:40]) + (f", ... ({len(paths)} in all)" if len(paths) > 40 else "")
