"""Names of what is in a structure: attribute names, keys and indices joined by dots."""

from typing import Any

import jax


def leaf_name(path: Any) -> str:
    """The name of a leaf from its path, empty where the structure is the leaf itself."""
    return ".".join(str(getattr(k, "name", getattr(k, "key", getattr(k, "idx", k)))) for k in path)


def named_leaves(structure: Any, alone: str) -> dict[str, Any]:
    """Leaves by name.

    Args:
        structure: any structure.
        alone: name where the structure is the leaf itself.
    """
    return {leaf_name(path) or alone: leaf for path, leaf in jax.tree_util.tree_leaves_with_path(structure)}
