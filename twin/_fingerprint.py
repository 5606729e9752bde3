"""What a study depends on, as text and digests: its function, its samples, the versions of what computes it."""

import functools
import hashlib
import importlib.metadata
import inspect
import sys
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import numpy as np

_PACKAGES = ("twin", "sensitivity", "fitting")
_VERSIONED = ("jax", "jaxlib", "numpy", "equinox", "diffrax", "optimistix")


def function_name(fn: Callable[..., Any]) -> str:
    """Module and name of a function, of a module's class, or of what a partial function calls."""
    fn = _inner(fn)
    owner = fn if hasattr(fn, "__qualname__") else type(fn)
    return f"{owner.__module__}.{owner.__qualname__}"


def function_digest(fn: Callable[..., Any]) -> str:
    """Digest of a function: its source, what it is closed over, the globals that it uses, the fields of a module.

    Functions of installed packages count by their name, as their versions are compared.
    """
    return _Digest().of(fn)


def samples_digest(samples: Any) -> str:
    """Digest of the samples: names, types, shapes and every bit."""
    return _Digest().of(samples)


@functools.cache
def versions() -> dict[str, str]:
    """Versions of what computes, and a digest of the sources of drivetwin itself."""
    found = {name: importlib.metadata.version(name) for name in _VERSIONED}
    found["python"] = ".".join(map(str, sys.version_info[:2]))
    sources = hashlib.sha256()
    for package in _PACKAGES:
        folder = Path(__file__).parents[1] / package
        for file in sorted(folder.rglob("*.py")):
            sources.update(file.relative_to(folder.parent).as_posix().encode() + b"\0" + file.read_bytes())
    try:
        own = importlib.metadata.version("drivetwin")
    except importlib.metadata.PackageNotFoundError:
        own = "not installed"
    found["drivetwin"] = f"{own} (sources {sources.hexdigest()[:12]})"
    return found


class _Digest:
    """Digest of a structure of functions, modules, arrays and plain values."""

    def __init__(self) -> None:
        self._sha = hashlib.sha256()
        self._seen: set[int] = set()
        self._kept: list[Any] = []  # what is known by its address must live

    def of(self, value: Any) -> str:
        self._add(value)
        return self._sha.hexdigest()

    def _add(self, value: Any) -> None:
        if isinstance(value, np.ndarray | np.generic | jax.Array):
            array = np.asarray(value)
            self._tell("array", array.dtype.str, str(array.shape))
            self._sha.update(np.ascontiguousarray(array).tobytes())
        elif value is None or isinstance(value, bool | int | float | complex | str | bytes):
            self._tell(type(value).__name__, repr(value))
        elif id(value) in self._seen:
            self._tell("again")
        else:
            self._seen.add(id(value))
            self._kept.append(value)
            self._structure(value)

    def _structure(self, value: Any) -> None:
        if isinstance(value, functools.partial):
            self._several("partial", value.func, value.args, value.keywords)
        elif isinstance(value, list | tuple):
            self._several(f"{type(value).__qualname__} {len(value)}", *value)
        elif isinstance(value, dict):
            self._several(f"dict {len(value)}", *[part for item in value.items() for part in item])
        elif isinstance(value, set | frozenset):
            self._several("set", *sorted(value, key=repr))
        elif isinstance(value, eqx.Module) or hasattr(value, "__dataclass_fields__"):
            self._class(type(value))
            fields = {name: getattr(value, name, None) for name in value.__dataclass_fields__}
            self._several(f"fields {len(fields)}", *[part for item in fields.items() for part in item])
        elif isinstance(value, types.MethodType):
            self._several("method", value.__self__, value.__func__)
        elif isinstance(value, types.ModuleType):
            self._tell("module", value.__name__)
        elif isinstance(value, type):
            self._class(value)
        elif hasattr(value, "__wrapped__"):
            self._several("wrapped", value.__wrapped__)
        elif isinstance(value, types.FunctionType):
            self._function(value)
        else:
            self._tell("other", f"{type(value).__module__}.{type(value).__qualname__}", getattr(value, "__name__", ""))

    def _several(self, kind: str, *parts: Any) -> None:
        self._tell(kind)
        for part in parts:
            self._add(part)

    def _class(self, cls: type) -> None:
        self._tell("class", f"{cls.__module__}.{cls.__qualname__}")
        if _is_own(cls.__module__):
            self._tell(_source(cls))

    def _function(self, function: types.FunctionType) -> None:
        self._tell("function", f"{function.__module__}.{function.__qualname__}")
        if not _is_own(function.__module__):
            return
        self._tell(_source(function))
        cells = [cell.cell_contents for cell in function.__closure__ or () if _filled(cell)]
        self._several("closure", *cells, function.__defaults__ or (), function.__kwdefaults__ or {})
        for name in sorted(_names(function.__code__)):
            if name in function.__globals__:
                self._several(f"global {name}", function.__globals__[name])

    def _tell(self, *texts: str) -> None:
        for text in texts:
            self._sha.update(text.encode() + b"\0")


def _inner(fn: Any) -> Any:
    while True:
        if isinstance(fn, functools.partial):
            fn = fn.func
        elif hasattr(fn, "__wrapped__"):
            fn = fn.__wrapped__
        else:
            return fn


def _is_own(module: str | None) -> bool:
    """Whether code is the user's own: neither installed, whose versions are compared, nor of drivetwin."""
    if module is None or module.split(".")[0] in (*_PACKAGES, *sys.stdlib_module_names):
        return module is None or module == "__main__"
    file = getattr(sys.modules.get(module), "__file__", None)
    return module == "__main__" or file is None or "site-packages" not in Path(file).parts


def _source(thing: Any) -> str:
    try:
        return inspect.getsource(thing)
    except (OSError, TypeError):  # typed into a prompt
        code = getattr(thing, "__code__", None)
        return "" if code is None else f"{code.co_code.hex()} {_constants(code)}"


def _constants(code: types.CodeType) -> str:
    return repr([_constants(c) if isinstance(c, types.CodeType) else c for c in code.co_consts])


def _names(code: types.CodeType) -> set[str]:
    inner = [constant for constant in code.co_consts if isinstance(constant, types.CodeType)]
    return {*code.co_names, *(name for one in inner for name in _names(one))}


def _filled(cell: Any) -> bool:
    try:
        cell.cell_contents  # noqa: B018
    except ValueError:
        return False
    return True
