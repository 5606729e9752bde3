"""Packages whose public names are loaded when they are first asked for, so that importing a package costs nothing."""

import sys
from collections.abc import Iterable, Mapping
from importlib import import_module
from types import ModuleType
from typing import Any


class LazyPackage(ModuleType):
    """A package that loads its public names when they are first asked for.

    Some functions have the name of the file that they are in, as `fitting.fit`. Python binds a submodule in its
    package when it is imported, so that such a name would be the function or the file, whichever came last. Here it is
    always the function; `from fitting.fit import fit` finds the file all the same.
    """

    _homes: dict[str, str]
    """Module that each public name is in."""

    def __getattr__(self, name: str) -> Any:
        if name in vars(self)["_homes"]:
            vars(self)[name] = getattr(import_module(self._homes[name]), name)
            return vars(self)[name]
        if name in self.__all__:
            return import_module(f"{self.__name__}.{name}")
        raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")

    def __setattr__(self, name: str, value: Any) -> None:
        # The import system binds a file here whose name is that of a function.
        if not (isinstance(value, ModuleType) and name in self._homes):
            super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return sorted(self.__all__)

    def __reduce__(self) -> tuple[Any, ...]:
        # By name, as any module: a function of a notebook that uses it is sent to workers.
        return import_module, (self.__name__,)


def load_lazily(package: str, names: Mapping[str, str], modules: Iterable[str] = ()) -> None:
    """Give a package public names that are loaded when they are first asked for.

    Args:
        package: `__name__` of the package.
        names: module that each name is in.
        modules: submodules that are public names too.
    """
    module = sys.modules[package]
    vars(module)["_homes"] = dict(names)
    vars(module)["__all__"] = [*names, *modules]
    module.__class__ = LazyPackage
