"""Linear or rotary: which of two units is meant where a text says "[m or rad]"."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from twin._checks import InputError
from twin.io.class_fields import FieldFacts
from twin.io.quantity import parse_quantity

_ANGULAR = re.compile(r"rad|Nm|kg m²|N m")


def pick_unit(units: Sequence[str] | None, rotary: bool | None) -> str:
    """The unit that is meant.

    Args:
        units: alternatives; None where any unit may be given.
        rotary: whether the drive turns; None takes the first alternative.

    Returns:
        One of them, empty where there is none.
    """
    if not units:
        return ""
    return next((unit for unit in units if rotary is not None and _is_angular(unit) == rotary), units[0])


def rotary_of(facts: Mapping[str, FieldFacts], written: Mapping[str, Any] | None = None) -> bool | None:
    """Whether a drive turns, by the units that its parameters were given in, else by what its text names first.

    Args:
        facts: what its class says of its arguments.
        written: the values as they were written.

    Returns:
        None where nothing tells.
    """
    open_ones = {name: one.units for name, one in facts.items() if one.units and len(one.units) > 1}
    for name, units in open_ones.items():
        value = (written or {}).get(name)
        fitting = [unit for unit in units if isinstance(value, str) and _has(value, unit)]
        if len(fitting) == 1:
            return _is_angular(fitting[0])
    return next((_is_angular(units[0]) for units in open_ones.values()), None)


def rotary_of_part(facts: FieldFacts, whole: bool | None) -> bool | None:
    """Whether a part turns, by what is said of it, else as the whole does.

    Args:
        facts: of the field that holds it.
        whole: whether the whole turns.
    """
    bracket = re.findall(r"\[([^\[\]]+)\]", facts.text)
    if not bracket or " or " in bracket[-1]:
        return whole
    return _is_angular(bracket[-1])


def _is_angular(unit: str) -> bool:
    return _ANGULAR.search(unit) is not None


def _has(written: str, unit: str) -> bool:
    try:
        parse_quantity(written, (unit,))
    except InputError:
        return False
    return True
