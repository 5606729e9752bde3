"""A number with its unit as text, "80 kg", as it is written in study files and on the command line."""

import math
import re
from collections.abc import Sequence
from typing import Any, NamedTuple

from twin._checks import InputError
from twin.io.units import si_unit, to_si

_NUMBER = re.compile(r"\s*([+-]?(?:(?:\d+(?:_\d+)*\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|inf))\s*(.*?)\s*\Z", re.DOTALL)


class Quantity(NamedTuple):
    """A value in SI."""

    value: float
    """Value, in the unit."""
    unit: str
    """SI unit; "1" for a plain number."""


def parse_quantity(written: Any, units: Sequence[str] | None = None, *, name: str = "value") -> Quantity:
    """Read a quantity.

    Args:
        written: text such as "80 kg", "1.5 mm/s", "3 %"; a bare number only where plain numbers are allowed.
        units: units of the dimensions that it may have, such as ("kg", "kg m²"); None for any.
        name: what it is, for the message.

    Returns:
        The value in SI.

    Raises:
        InputError: no number, no unit where one is needed, an unknown unit, or another dimension.
    """
    if isinstance(written, bool) or not isinstance(written, int | float | str):
        raise InputError(f"{name} must be a quantity such as {_example(units)}, but is {written!r}.")
    if isinstance(written, str):
        match = _NUMBER.match(written)
        if not match or match.group(2).startswith(","):
            comma = " Write a decimal point, not a comma." if "," in written else ""
            raise InputError(
                f"{name} must be a number with its unit, such as {_example(units)}, but is {written!r}.{comma}"
            )
        number, unit = float(match.group(1)), match.group(2)
    else:
        number, unit = float(written), ""
    if math.isnan(number):
        raise InputError(f"{name} must be a number, but is NaN. Write it with its unit, such as {_example(units)}.")
    if unit == "%":
        number, unit = number / 100, "1"
    if not unit and units is not None and "1" not in units:
        # Zero and infinity are the same in every unit.
        if number == 0 or math.isinf(number):
            return Quantity(number, si_unit(units[0], name=name))
        raise InputError(f"{name} has no unit: {written!r}. Write it as text with its unit, such as {_example(units)}.")
    unit = unit or "1"
    if units is None:
        return Quantity(float(to_si(number, unit, name=name)), si_unit(unit, name=name))
    problems = []
    for expected in units:
        try:
            return Quantity(float(to_si(number, unit, expected, name=name)), si_unit(unit, expected, name=name))
        except InputError as error:
            problems.append(error)
    raise problems[0]


def _example(units: Sequence[str] | None) -> str:
    return f'"5 {units[0]}"' if units and units[0] != "1" else '5 or "5 mm"'
