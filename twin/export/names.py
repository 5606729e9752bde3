"""Names, units and descriptions of what a plant's structures hold, read from the docstrings beside their fields."""

import re
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp

from twin._tree_names import leaf_name
from twin.io.class_fields import field_texts
from twin.plant import AbstractPlant

# A unit that leaves a choice, or a relation of two, is no unit to write into a file.
_UNCLEAR = re.compile(r" or |,|;|:|\bunit\b| over | per |\.\.\.")


@dataclass(frozen=True)
class Quantity:
    """One number of a structure."""

    name: str
    """Its name: attributes, keys and indices joined by dots."""
    unit: str = ""
    """SI unit, "1" for a plain number, empty where the docstring leaves it open."""
    description: str = ""
    """First sentence of the docstring."""


def quantities(structure: Any, *, alone: str = "value") -> tuple[Quantity, ...]:
    """Every number of a structure, in the order of its flattening.

    Args:
        structure: states, inputs, outputs or a model.
        alone: name where the structure is one number without a name.
    """
    found = []
    for keys, leaf in jax.tree_util.tree_leaves_with_path(structure):
        name = leaf_name(keys) or alone
        unit, description = _facts(structure, keys)
        many = [f"{name}.{i}" for i in range(jnp.size(leaf))] if jnp.ndim(leaf) else [name]
        found += [Quantity(one, unit, description) for one in many]
    return tuple(found)


def state_names(plant: AbstractPlant) -> tuple[str, ...]:
    """Names of a plant's states, in the order in which `linearise` has them.

    Args:
        plant: any plant.
    """
    return tuple(one.name for one in quantities(plant.initial_state(), alone="state"))


def _facts(structure: Any, keys: Any) -> tuple[str, str]:
    """Unit and description of the innermost field on the way that has a docstring."""
    node, unit, text = structure, "", ""
    for key in keys:
        name = getattr(key, "name", None)
        if name is not None:
            told = field_texts(type(node)).get(name)
            unit, text = (_unit(told), _sentence(told)) if told else (unit, text)
            node = getattr(node, name)
        else:
            index: Any = getattr(key, "key", getattr(key, "idx", None))
            node = node[index] if isinstance(node, dict | list | tuple) else None
    return unit, text


def _unit(text: str) -> str:
    match = re.search(r"\[([^\]]+)\]", text)
    if match is None or _UNCLEAR.search(match[1]):
        return ""
    return "1" if match[1] == "-" else match[1]


def _sentence(text: str) -> str:
    return re.split(r"(?<=[\w\])])\. ", text)[0].rstrip(".")
