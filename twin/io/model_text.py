"""From a model to the table of a study file that describes it, with a comment for every value."""

import dataclasses
import math
from typing import Any

import equinox as eqx
import jax
import numpy as np

from twin._checks import InputError
from twin.io.class_fields import FieldFacts, facts_of, summary_of
from twin.io.model_types import known_types
from twin.io.rotary import pick_unit, rotary_of, rotary_of_part
from twin.io.units import si_unit

_WIDTH = 46


def model_text(model: Any, key: str = "model", *, rotary: bool | None = None) -> str:
    """A model as TOML, which `twin.io.model_table.build_model` reads again.

    Args:
        model: a drive, a loop, a law, of types that study files know.
        key: name of its table.
        rotary: whether a drive turns that may be linear or rotary; None for what its text names first.

    Returns:
        Text of the table with all tables below it.

    Raises:
        InputError: a part of a type that study files do not know.
    """
    return "\n".join(_table(model, key, key, rotary)).strip() + "\n"


def _table(part: Any, key: str, root: str, rotary: bool | None, brackets: tuple[str, str] = ("[", "]")) -> list[str]:
    kind = type(part)
    if kind.__name__ not in known_types():
        raise InputError(
            f"{kind.__name__} has no name in study files; they know {', '.join(sorted(known_types()))}. "
            "Describe the model in Python instead."
        )
    facts = facts_of(kind)
    rotary = rotary_of(facts) if rotary is None else rotary
    lines = ["", f"{brackets[0]}{key}{brackets[1]}", _line("type", f'"{kind.__name__}"', summary_of(kind))]
    below: list[str] = []
    written: list[tuple[str, Any]] = []
    for field in dataclasses.fields(part):
        value, told = getattr(part, field.name), facts.get(field.name)
        if told is None or value is None:
            continue
        if isinstance(value, eqx.Module):
            same = next((name for name, other in written if bool(eqx.tree_equal(other, value))), None)
            if same:
                path = f"{key}.{same}".removeprefix(f"{root}.")
                lines.append(_line(field.name, f'{{ like = "{path}" }}', f"{told.text} The same as {same}."))
                continue
            written.append((field.name, value))
            if not jax.tree.leaves(value) and not dataclasses.fields(value):
                lines.append(_line(field.name, f'{{ type = "{type(value).__name__}" }}', told.text))
            else:
                below += _table(value, f"{key}.{field.name}", root, rotary_of_part(told, rotary))
        elif isinstance(value, tuple) and value and all(isinstance(one, eqx.Module) for one in value):
            for one in value:
                below += _table(one, f"{key}.{field.name}", root, rotary_of_part(told, rotary), ("[[", "]]"))
        elif (text := _written(value, told, rotary)) is not None:
            lines.append(_line(field.name, text, told.text))
    return lines + below


def _written(value: Any, facts: FieldFacts, rotary: bool | None) -> str | None:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f'"{value}"'
    if facts.static:
        return repr(value) if isinstance(value, int | float) else None
    array = np.asarray(value)
    if array.ndim == 0:
        return None if math.isinf(array) else _quantity(float(array), facts, rotary)
    return "[" + ", ".join(_quantity(one, facts, rotary) for one in array.tolist()) + "]" if array.ndim == 1 else None


def _quantity(value: float, facts: FieldFacts, rotary: bool | None) -> str:
    unit = pick_unit(facts.units, rotary)
    unit = si_unit(unit, unit) if unit else ""
    number = f"{value:.15g}" if float(f"{value:.15g}") == value else repr(value)
    return number if unit in ("", "1") else f'"{number} {unit}"'


def _line(name: str, value: str, comment: str) -> str:
    text = f"{name} = {value}"
    return f"{text:{_WIDTH}}  # {comment}" if comment else text
