"""The types that a study file may name: every drive, controller, law, reference and stepping of the package.

Nothing is registered: what a package of models exports can be named, in any spelling of its class or function:
"ServoAxis", "servo_axis", "servo axis".
"""

import functools
import inspect
from collections.abc import Callable
from typing import Any, get_type_hints

import equinox as eqx

from twin import control, drives, laws, references, stepping
from twin._checks import InputError
from twin.io.class_fields import facts_of
from twin.io.toml_document import unknown
from twin.plant import AbstractPlant

_ROOMS = (drives, control, laws, references, stepping)
_RESULTS = (
    "ClosedLoopPoles",
    "StabilityReport",
    "ScrewMatrices",
    "SpringDeformations",
    "FrictionSlope",
    "TwoMassModes",
)


@functools.cache
def known_types() -> dict[str, Callable[..., Any]]:
    """Classes, and functions that make a drive, by name."""
    found: dict[str, Callable[..., Any]] = {}
    for room in _ROOMS:
        for name, one in vars(room).items():
            if name.startswith(("_", "Abstract")) or name in _RESULTS:
                continue
            makes = one if inspect.isclass(one) else _made_by(one)
            kind = eqx.Module if inspect.isclass(one) else AbstractPlant
            if inspect.isclass(makes) and issubclass(makes, kind) and not inspect.isabstract(makes):
                found[name] = one
    return found


def type_named(name: str, kind: Any = None) -> Callable[..., Any]:
    """The type of a name.

    Args:
        name: in any spelling.
        kind: class of which it must be, None for any.

    Raises:
        InputError: an unknown name, or one of another kind; the message lists those there are.
    """
    fitting = types_of(kind)
    if name in fitting:
        return fitting[name]
    for known, one in fitting.items():
        if _plain(known) == _plain(name):
            return one
    if any(_plain(known) == _plain(name) for known in known_types()):
        raise InputError(f"{name!r} does not go here; what goes here is {', '.join(sorted(fitting)) or 'nothing'}.")
    raise InputError(unknown("type", name, fitting))


def types_of(kind: Any = None) -> dict[str, Callable[..., Any]]:
    """Types that make something of a kind.

    Args:
        kind: a class; None for all.
    """
    if not (inspect.isclass(kind) and issubclass(kind, eqx.Module)):
        return known_types()
    return {name: one for name, one in known_types().items() if issubclass(_product(one), kind)}


def default_type(kind: Any) -> Callable[..., Any] | None:
    """The type that goes without saying: the only one of its kind.

    Args:
        kind: annotation of a field.
    """
    if not (inspect.isclass(kind) and issubclass(kind, eqx.Module)):
        return None
    if not inspect.isabstract(kind) and kind.__name__ in known_types():
        return kind
    of_kind = list(types_of(kind).values()) if inspect.isabstract(kind) else []
    return of_kind[0] if len(of_kind) == 1 else None


def unit_of_leaf(model: Any, path: str) -> tuple[str, ...] | None:
    """Units that the number at a path of a model may have, None for any.

    Args:
        model: a model.
        path: dotted path of a number in it.
    """
    node = model
    names = path.split(".")
    while names and names[-1].isdigit():  # an element of a vector has the unit of the vector
        names.pop()
    for name in names[:-1]:
        node = node[int(name)] if name.isdigit() else node[name] if isinstance(node, dict) else getattr(node, name)
    try:
        facts = facts_of(type(node))
    except (TypeError, ValueError):
        return None
    return facts[names[-1]].units if names and names[-1] in facts else None


def _product(one: Callable[..., Any]) -> Any:
    return one if inspect.isclass(one) else _made_by(one)


def _made_by(function: Any) -> Any:
    """What a function makes, by its annotation; None for anything but a function, and for one that changes a model."""
    if not inspect.isfunction(inspect.unwrap(function)):
        return None
    try:
        hints = get_type_hints(inspect.unwrap(function))
    except (NameError, TypeError):
        return None
    made = hints.pop("return", None)
    takes_models = any(inspect.isclass(hint) and issubclass(hint, AbstractPlant) for hint in hints.values())
    return None if takes_models else made


def _plain(name: str) -> str:
    return "".join(c for c in name.lower() if c.isalnum())
