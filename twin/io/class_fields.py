"""What a class or function says of its own arguments in its docstrings: text, units, whether they must be given.

A field of a module is described by the text beneath it, an argument of a function by its line under "Args:"; the unit
stands in brackets at the end of a sentence, several alternatives joined by "or".
"""

import ast
import dataclasses
import functools
import inspect
import itertools
import re
import textwrap
from collections.abc import Callable
from typing import Any, cast

# What is written between brackets where any unit may be given.
_OPEN = ("command unit", "output's unit", "...", " over ")


@dataclasses.dataclass(frozen=True)
class FieldFacts:
    """One argument of a class or function."""

    name: str
    """Name."""
    text: str
    """What it is."""
    units: tuple[str, ...] | None
    """Units of the dimensions that it may have; None where any may be given."""
    required: bool
    """Whether it has no default."""
    default: Any
    """The default, None where there is none or it is made anew each time."""
    static: bool
    """Whether it is a plain choice, such as text or a whole number, rather than a quantity or a part."""
    type: Any
    """Its annotation."""


@functools.cache
def facts_of(made: Callable[..., Any]) -> dict[str, FieldFacts]:
    """What a class or function says of its arguments.

    Args:
        made: an equinox module or a function with a docstring in the style of this project.

    Returns:
        Facts by name, in the order of the arguments.
    """
    described = dict(field_texts(made)) if inspect.isclass(made) else {}
    if not inspect.isclass(made) or "__init__" in vars(made):
        described |= _of_arguments(made.__init__ if inspect.isclass(made) else made)
    fields = {f.name: f for f in dataclasses.fields(made)} if dataclasses.is_dataclass(made) else {}
    found = {}
    for name, argument in inspect.signature(cast(Any, made)).parameters.items():
        if argument.kind in (argument.VAR_POSITIONAL, argument.VAR_KEYWORD):
            continue
        field = fields.get(name)
        text = described.get(name, "")
        has_default = argument.default is not inspect.Parameter.empty
        plain = has_default and isinstance(argument.default, int | float | str | bool)
        found[name] = FieldFacts(
            name=name,
            text=text,
            units=_units(text),
            required=not has_default,
            default=argument.default if plain else None,
            static=bool(field and field.metadata.get("static")) or isinstance(argument.default, str),
            type=field.type if field else argument.annotation,
        )
    return found


@functools.cache
def field_texts(made: type) -> dict[str, str]:
    """The text under each field of a class, and of the classes it is made from.

    Args:
        made: a class; one that was typed in has no source, and no texts.
    """
    found: dict[str, str] = {}
    for owner in reversed(made.__mro__):
        if owner.__module__.startswith(("builtins", "abc", "equinox")):
            continue
        try:
            body = ast.parse(textwrap.dedent(inspect.getsource(owner))).body[0]
        except (OSError, TypeError, SyntaxError):  # no source at hand, as in a class that was typed in
            continue
        statements = getattr(body, "body", [])
        for field, below in itertools.pairwise(statements):
            if not (isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)):
                continue
            told = below.value.value if isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant) else None
            if isinstance(told, str):
                found[field.target.id] = " ".join(told.split())
    return found


def summary_of(made: Callable[..., Any]) -> str:
    """The first sentence of a docstring.

    Args:
        made: a class or function.
    """
    text = inspect.getdoc(made) or ""
    return " ".join(text.split("\n\n")[0].split())


def _of_arguments(made: Any) -> dict[str, str]:
    match = re.search(r"^Args:\n(.*?)(?=^\S|\Z)", inspect.getdoc(made) or "", flags=re.MULTILINE | re.DOTALL)
    if not match:
        return {}
    found = {}
    for entry in re.split(r"(?m)^(?=\w+: )", textwrap.dedent(match.group(1))):
        name, colon, text = entry.partition(":")
        if colon and name.strip().isidentifier():
            found[name.strip()] = " ".join(text.split())
    return found


def _units(text: str) -> tuple[str, ...] | None:
    brackets = re.findall(r"\[([^\[\]]+)\]", text)
    if not brackets or any(part in brackets[-1] for part in _OPEN):
        return None
    listed = re.split(r", for |;", brackets[-1])[0]
    return tuple(_written(unit) for unit in re.split(r" or |, ", listed))


def _written(unit: str) -> str:
    over, per, under = unit.strip().partition(" per ")
    unit = f"({over})/({under})" if per else over
    return "1" if unit == "-" else unit
