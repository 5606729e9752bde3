"""Names of what is in a structure: attribute names, keys and indices joined by dots."""

from typing import Any


def leaf_name(path: Any) -> str:
    """The name of a leaf from its path, empty where the structure is the leaf itself."""
    return ".".join(str(getattr(k, "name", getattr(k, "key", getattr(k, "idx", k)))) for k in path)
