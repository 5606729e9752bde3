"""A walk through all that a function consists of, with a digest for each part that can be named in a message."""

import contextlib
import dis
import functools
import hashlib
import importlib
import types
from collections.abc import Iterable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from twin._fingerprint_packages import is_own, module_of_compiled, package_of

_RULES = ("jvp", "fwd", "bwd", "vmap_rule")
"""Attributes in which JAX keeps the rules of functions with a derivative of their own."""
_CHECKERS = ("jaxtyping", "beartype", "typeguard")
"""Packages whose wrappers change no result, and hold names that are made up anew in each process."""
_PLAIN = bool | int | float | complex | str | bytes | types.NoneType


class Walk:
    """Digests by the words that say what they are of.

    Code counts as it was compiled, so that comments do not, nor edits of a file that is not loaded again.
    """

    def __init__(self, given: str | None = None) -> None:
        """Begin.

        Args:
            given: module whose code counts wherever it lies.
        """
        self.packages: set[str] = set()
        """Installed packages that were met, by the names under which they are imported."""
        self._given = given
        self._sums: dict[str, Any] = {}
        self._visited: set[Any] = set()
        self._open: list[int] = []
        self._kept: list[Any] = []  # what is known by its address must live

    def digests(self) -> dict[str, str]:
        """Digests of what was added."""
        return {where: sha.hexdigest()[:16] for where, sha in self._sums.items()}

    def add(self, where: str, value: Any) -> None:
        """Add a value and all that belongs to it.

        Args:
            where: words for what it is.
            value: anything.
        """
        if isinstance(value, np.ndarray | np.generic | jax.Array):
            self._array(where, value)
        elif isinstance(value, _PLAIN):
            self._tell(where, type(value).__name__, repr(value))
        elif isinstance(value, types.ModuleType):
            self._is_own(value.__name__)
            self._tell(where, "module", value.__name__)
        elif isinstance(value, type):
            self._tell(where, "class", f"{value.__module__}.{value.__qualname__}")
            self._class(value)
        elif isinstance(value, types.FunctionType) and self._is_own(value.__globals__.get("__name__")):
            self._tell(where, "function", _name(value))
            self._function(value)
        elif id(value) in self._open:
            self._tell(where, "itself", str(len(self._open) - self._open.index(id(value))))
        else:
            self._open.append(id(value))
            self._structure(where, value)
            self._open.pop()

    def _array(self, where: str, value: Any) -> None:
        if isinstance(value, jax.Array) and jnp.issubdtype(value.dtype, jax.dtypes.prng_key):
            self._tell(where, f"key {jax.random.key_impl(value)}")
            value = jax.random.key_data(value)
        array = np.asarray(value)
        self._tell(where, "array", array.dtype.str, str(array.shape))
        if array.dtype.hasobject:
            self.add(where, array.tolist())  # its bytes are addresses
        else:
            self._sums[where].update(np.ascontiguousarray(array).tobytes())

    def _structure(self, where: str, value: Any) -> None:
        if isinstance(value, functools.partial | functools.partialmethod):
            self.add(where, value.func)
            named = {**{str(i): v for i, v in enumerate(value.args)}, **value.keywords}
            self._items("argument ", named)
        elif isinstance(value, list | tuple):
            self._several(where, f"{type(value).__qualname__} {len(value)}", value)
        elif isinstance(value, dict):
            # The order of names is no part of the matter: JAX sorts them.
            items = sorted(value.items(), key=lambda item: self._sorting(item[0]))
            self._several(where, f"dict {len(items)}", [part for item in items for part in item])
        elif isinstance(value, set | frozenset):
            self._several(where, "set", sorted(value, key=self._sorting))
        elif hasattr(value, "__wrapped__") and hasattr(value, "lower"):  # compiled, by JAX or equinox
            self._several(where, "compiled", (value.__wrapped__,))
        elif hasattr(value, "__dataclass_fields__"):
            self.add(where, type(value))
            inside = f"{where}." if where.startswith("field ") else "field "
            fields = value.__dataclass_fields__.items()
            counting = [name for name, field in fields if field.metadata.get("changes_results") is not False]
            self._items(inside, {name: getattr(value, name, None) for name in counting})
        elif isinstance(value, types.MethodType):
            self._several(where, "method", (value.__self__, value.__func__))
        elif isinstance(value, property):
            self._several(where, "property", (value.fget, value.fset))
        elif isinstance(value, functools.cached_property):
            self._several(where, "property", (value.func,))
        elif isinstance(value, types.FunctionType):
            self._installed(where, value)
        elif hasattr(value, "__wrapped__"):
            rules = [getattr(value, rule) for rule in _RULES if hasattr(value, rule)]
            self._several(where, "wrapped", (value.__wrapped__, *rules))
        elif isinstance(value, types.BuiltinFunctionType | np.ufunc):
            module = getattr(value, "__module__", None) or module_of_compiled(value.__name__, value)
            self._is_own(module)
            self._tell(where, "installed", f"{module}.{getattr(value, '__qualname__', value.__name__)}")
            owner = getattr(value, "__self__", None)
            if owner is not None and not isinstance(owner, types.ModuleType):
                self.add(where, owner)
        else:
            self._object(where, value)

    def _installed(self, where: str, function: types.FunctionType) -> None:
        """A function of a package, which counts by its name, with what it was made from."""
        self._tell(where, "installed", _name(function))
        self.add(where, getattr(function, "__wrapped__", None))
        if str(function.__globals__.get("__name__")).split(".")[0] in _CHECKERS:
            return
        for cell in function.__closure__ or ():
            if cell != types.CellType() and not _is_inside_jax(cell.cell_contents):
                self.add(where, cell.cell_contents)

    def _object(self, where: str, value: Any) -> None:
        """Any other object, by what it would be copied from."""
        self._is_own(type(value).__module__)
        self._tell(where, "object", f"{type(value).__module__}.{type(value).__qualname__}")
        try:
            parts = value.__reduce_ex__(2)
        except Exception:  # a lock, a file: nothing that a result could depend on and be told again
            return
        self._kept.append(parts)
        if isinstance(parts, str):
            self._tell(where, parts)
        else:
            self._several(where, "parts", [list(p) if hasattr(p, "__next__") else p for p in parts])

    def _several(self, where: str, kind: str, parts: Iterable[Any]) -> None:
        self._tell(where, kind)
        for part in parts:
            self.add(where, part)

    def _items(self, before: str, named: dict[str, Any]) -> None:
        for name in sorted(named):
            self.add(f"{before}{name}", named[name])

    def _class(self, cls: type) -> None:
        for owner in cls.__mro__:
            if not self._is_own(owner.__module__) or self._was_here(owner):
                continue
            fields = vars(owner).get("__dataclass_fields__", {})
            for name, value in sorted(vars(owner).items()):
                counts = name not in fields or fields[name].metadata.get("changes_results") is not False
                if counts and (not name.startswith("__") or _is_method(name, value)):
                    self.add(f"{name} of the class {_name(owner)}", value)

    def _function(self, function: types.FunctionType) -> None:
        if self._was_here(function):
            return
        name, names = _name(function), _names(function.__code__)
        self._tell(f"the code of {name}", _code(function.__code__))
        for cell_name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
            if cell != types.CellType():  # an empty one
                self.add(f"{cell_name}, which {name} is closed over", cell.cell_contents)
        self.add(f"a default of {name}", [function.__defaults__, function.__kwdefaults__])
        module = str(function.__globals__.get("__name__"))
        self._globals(module, function.__globals__, names)
        self._globals(f"what {name} imports", _imported(function.__code__), names)

    def _globals(self, module: str, found: dict[str, Any], names: set[str]) -> None:
        for name in sorted(names & found.keys()):
            value = found[name]
            if isinstance(value, types.ModuleType) and self._is_own(value.__name__):
                if not self._was_here(value, frozenset(names)):
                    self._globals(value.__name__, vars(value), names)
            elif not self._was_here(module, name):
                self.add(f"{name} of {module}", value)

    def _sorting(self, value: Any) -> str:
        """What a member of a set is sorted by: not its address, nor where its hash puts it."""
        if isinstance(value, _PLAIN):
            return repr(value)
        alone = Walk(self._given)
        alone._open = [*self._open]
        alone.add("member", value)
        return repr(sorted(alone.digests().items()))

    def _is_own(self, module: str | None) -> bool:
        """Whether code counts as it is; the package of any other is noted."""
        own = module == self._given or is_own(module)
        package = None if module is None or is_own(module) else package_of(module)
        if package is not None:
            self.packages.add(package)
        return own

    def _was_here(self, *what: Any) -> bool:
        key = tuple(one if isinstance(one, str | frozenset) else id(one) for one in what)
        was = key in self._visited
        self._visited.add(key)
        self._kept.append(what)
        return was

    def _tell(self, where: str, *texts: str) -> None:
        self._sums.setdefault(where, hashlib.sha256()).update("\0".join([*texts, ""]).encode(errors="surrogatepass"))


def _name(thing: Any) -> str:
    return f"{thing.__module__}.{thing.__qualname__}"


def _is_method(name: str, value: Any) -> bool:
    """Whether a name of Python's is defined in a class to do something."""
    return not name.startswith("__annotat") and (callable(value) or isinstance(value, staticmethod | classmethod))


def _is_inside_jax(value: Any) -> bool:
    """Whether a thing belongs to the inner workings of JAX."""
    known = isinstance(value, jax.Array | functools.partial | types.FunctionType) or hasattr(value, "__wrapped__")
    return not known and type(value).__module__.split(".")[0] in ("jax", "jaxlib")


def _code(code: types.CodeType) -> str:
    constants = [_constant(constant) for constant in code.co_consts]
    names = (code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars)
    return f"{code.co_code.hex()} {code.co_argcount} {names} {constants}"


def _constant(value: Any) -> str:
    if isinstance(value, types.CodeType):
        return _code(value)
    return repr(sorted(value, key=repr) if isinstance(value, frozenset) else value)


def _imported(code: types.CodeType) -> dict[str, Any]:
    """Modules that a function imports when it is called, those that can be."""
    found = {}
    for instruction in dis.get_instructions(code):
        if instruction.opname == "IMPORT_NAME":
            with contextlib.suppress(ImportError, TypeError):
                found[instruction.argval] = importlib.import_module(instruction.argval)
    return found


def _names(code: types.CodeType) -> set[str]:
    inner = [constant for constant in code.co_consts if isinstance(constant, types.CodeType)]
    return {*code.co_names, *(name for one in inner for name in _names(one))}
