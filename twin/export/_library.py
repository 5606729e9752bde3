"""Libraries that only some exports need: loaded late, and missed with one clear error."""

import importlib
from types import ModuleType

from twin._checks import InputError


def library(module: str, package: str) -> ModuleType:
    """A library of the extra `export`.

    Args:
        module: what is imported.
        package: name under which it is installed.

    Raises:
        InputError: if it is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise InputError(
            f"This export needs {package}, which cannot be loaded ({error}). Install it by "
            "`pip install drivetwin[export]`."
        ) from error
