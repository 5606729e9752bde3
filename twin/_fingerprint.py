"""What a study depends on, as text and digests: its function, its samples, the versions of what computes it."""

import functools
import hashlib
import importlib.metadata
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax

from twin._fingerprint_packages import OWN_PACKAGES, VERSIONED, package_of, package_versions
from twin._fingerprint_walk import Walk


def function_name(fn: Callable[..., Any]) -> str:
    """Module and name of a function, of a module's class, or of what a partial function calls."""
    owner = _owner(fn)
    return f"{owner.__module__}.{owner.__qualname__}"


def function_parts(fn: Callable[..., Any]) -> dict[str, str]:
    """The digests of `function_facts`."""
    return function_facts(fn)[0]


def function_facts(fn: Callable[..., Any]) -> tuple[dict[str, str], dict[str, str]]:
    """What a function consists of, and the versions of the packages that it uses.

    Returns:
        Digests of all that it consists of, by words for a message: its code and that of what it calls, what it is
        closed over, the globals that it uses, the fields of a module. Comments do not count, nor fields of a dataclass
        whose metadata say `"changes_results": False`. Functions of installed packages count by their name, but for
        those of the module that the function itself is in.
        Versions of those packages by the name of their distribution.
    """
    module = _owner(fn).__module__
    walk = Walk(module if module and package_of(module) else None)
    walk.add("the function itself", fn)
    return walk.digests(), package_versions(walk.packages)


def samples_digest(samples: Any) -> str:
    """Digest of the samples: names, types, shapes and every bit."""
    walk = Walk()
    walk.add("samples", samples)
    return hashlib.sha256(repr(sorted(walk.digests().items())).encode()).hexdigest()


@functools.cache
def versions() -> dict[str, str]:
    """Versions of what computes, and a digest of the sources of drivetwin itself."""
    found = {name: importlib.metadata.version(name) for name in VERSIONED}
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


def platform() -> str:
    """Kind of device that computes."""
    return jax.default_backend()


def _owner(fn: Any) -> Any:
    fn = _inner(fn)
    return fn if hasattr(fn, "__qualname__") else type(fn)


def _inner(fn: Any) -> Any:
    while True:
        if isinstance(fn, functools.partial):
            fn = fn.func
        elif hasattr(fn, "__wrapped__"):
            fn = fn.__wrapped__
        else:
            return fn
