"""Which code is the user's own, and which is installed: that counts by the version of its package."""

import functools
import importlib.metadata
import sys
from collections.abc import Iterable
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import Any

OWN_PACKAGES = ("twin", "sensitivity", "fitting")
VERSIONED = ("jax", "jaxlib", "numpy", "equinox", "diffrax", "optimistix")
"""Packages whose versions count for every study."""
_INSTALLED = ("site-packages", "dist-packages")


def is_own(module: str | None) -> bool:
    """Whether code is the user's own: neither installed, whose versions are compared, nor of drivetwin."""
    if module is None or module == "__main__":
        return True
    if _top(module) in (*OWN_PACKAGES, *sys.stdlib_module_names):
        return False
    file = getattr(sys.modules.get(module), "__file__", None)
    return file is None or not set(_INSTALLED) & set(Path(file).parts)


def package_of(module: str) -> str | None:
    """Name under which an installed package is imported; None for what counts for every study."""
    top = _top(module)
    return None if top in (*OWN_PACKAGES, *VERSIONED, *sys.stdlib_module_names) else top


def package_versions(packages: Iterable[str]) -> dict[str, str]:
    """Versions of installed packages by the name of their distribution.

    Args:
        packages: names under which they are imported.
    """
    names = {name for package in packages for name in _distributions().get(package, ())}
    return {name: importlib.metadata.version(name) for name in sorted(names)}


def module_of_compiled(name: str, value: Any) -> str | None:
    """The compiled module that holds a thing which does not tell its module itself, as functions of `scipy.special`."""
    for module_name, module in sorted(sys.modules.items()):
        file = getattr(module, "__file__", None)
        if isinstance(file, str) and file.endswith(tuple(EXTENSION_SUFFIXES)) and vars(module).get(name) is value:
            return module_name
    return None


@functools.cache
def _distributions() -> dict[str, list[str]]:
    return dict(importlib.metadata.packages_distributions())  # reads what is installed: a tenth of a second


def _top(module: str) -> str:
    return module.split(".")[0]
