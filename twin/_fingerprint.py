"""What a study depends on, as text and digests: its function, its samples, the versions of what computes it."""

import functools
import hashlib
import importlib.metadata
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from twin._fingerprint_walk import OWN_PACKAGES, Walk

_VERSIONED = ("jax", "jaxlib", "numpy", "equinox", "diffrax", "optimistix")


def function_name(fn: Callable[..., Any]) -> str:
    """Module and name of a function, of a module's class, or of what a partial function calls."""
    fn = _inner(fn)
    owner = fn if hasattr(fn, "__qualname__") else type(fn)
    return f"{owner.__module__}.{owner.__qualname__}"


def function_parts(fn: Callable[..., Any]) -> dict[str, str]:
    """Digests of all that a function consists of, by words for a message: its code and that of what it calls, what it
    is closed over, the globals that it uses, the fields of a module.

    Comments do not count. Functions of installed packages count by their name, as their versions are compared.
    """
    walk = Walk()
    walk.add("the function itself", fn)
    return walk.digests()


def samples_digest(samples: Any) -> str:
    """Digest of the samples: names, types, shapes and every bit."""
    walk = Walk()
    walk.add("samples", samples)
    return hashlib.sha256(repr(sorted(walk.digests().items())).encode()).hexdigest()


@functools.cache
def versions() -> dict[str, str]:
    """Versions of what computes, and a digest of the sources of drivetwin itself."""
    found = {name: importlib.metadata.version(name) for name in _VERSIONED}
    found["python"] = ".".join(map(str, sys.version_info[:2]))
    sources = hashlib.sha256()
    for package in OWN_PACKAGES:
        folder = Path(__file__).parents[1] / package
        for file in sorted(folder.rglob("*.py")):
            sources.update(file.relative_to(folder.parent).as_posix().encode() + b"\0" + file.read_bytes())
    try:
        own = importlib.metadata.version("drivetwin")
    except importlib.metadata.PackageNotFoundError:
        own = "not installed"
    found["drivetwin"] = f"{own} (sources {sources.hexdigest()[:12]})"
    return found


def _inner(fn: Any) -> Any:
    while True:
        if isinstance(fn, functools.partial):
            fn = fn.func
        elif hasattr(fn, "__wrapped__"):
            fn = fn.__wrapped__
        else:
            return fn
