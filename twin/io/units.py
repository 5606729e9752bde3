"""Units at the edge: what comes in from a file is converted to SI here, by pint, and nowhere else.

Three readings differ from pint's own, because its own would be silently wrong for drives:

- pint takes a radian for a plain number, so that it turns 50 Hz into 50 rad/s and 60 rpm into 6.28 Hz. Here a rotation
  (rad/s, rpm) and a frequency (Hz) do not convert into each other.
- `1/min` and `min^-1` mean revolutions per minute, unless a frequency is expected.
- `Nm` means newton metre; pint reads something else without complaint. So `Nms`, `Ns` and `Vs` are products too.
"""

import functools
import re
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from jaxtyping import ArrayLike

from twin._checks import InputError

if TYPE_CHECKING:
    import pint

_PER_MINUTE = frozenset({"1/min", "min^-1", "min**-1", "min-1", "/min", "min⁻¹", "1/minute"})
_REVOLUTIONS_PER_MINUTE = frozenset({"RPM", "U/min", "r/min", "rev/min", "Upm"})
_SUPERSCRIPTS = {ord("²"): "^2", ord("³"): "^3", ord("⁻"): "^-", ord("¹"): "1"}
# In order of preference where two have the same dimension, as N m and J.
_SI_NAMES = (
    *("1", "s", "m", "m/s", "m/s^2", "m/s^3", "rad", "rad/s", "rad/s^2", "rad/s^3", "Hz", "kg", "kg m^2", "K"),
    *("N", "N m", "N/m", "N s/m", "N m/rad", "N m s/rad", "Pa", "W", "A", "V", "ohm", "H"),
    *("N/A", "N m/A", "N/V", "N m/V", "V s/m", "V s/rad", "N^2 s/m", "1/s", "V/rad", "N m^2"),
)


def to_si(
    values: ArrayLike | list | tuple, unit: str, expected: str | None = None, *, name: str = "values"
) -> np.ndarray:
    """Convert measured values to SI.

    Args:
        values: numbers of any shape, in `unit`.
        unit: the unit they are in, such as "mm", "rpm", "1/min", "deg", "bar", "Nm".
        expected: a unit of the dimension they must have, such as "m/s"; its size does not matter. None takes any.
        name: the channel or argument, for the message.

    Returns:
        The values in SI units (rad for angles, K for temperatures), same shape, double precision.

    Raises:
        InputError: if the unit is unknown or has not the expected dimension.
    """
    parsed = _parse_in_context(unit, expected, name)
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} must hold numbers, but {error}. Give real numbers in {unit}.") from error
    return np.asarray(_registry().Quantity(array, parsed).to_base_units().magnitude, dtype=np.float64)


def si_unit(unit: str, expected: str | None = None, *, name: str = "values") -> str:
    """The name of the SI unit that `to_si` converts to, such as "rad/s" for "rpm".

    Args:
        unit: any known unit.
        expected: as in `to_si`.
        name: the channel or argument, for the message.

    Raises:
        InputError: as `to_si` does.
    """
    base = _base(_parse_in_context(unit, expected, name))
    if expected in _SI_NAMES:
        return expected
    known = next((si for si in _SI_NAMES if _base(_parse(si, name)) == base), None)
    return known or f"{base:~}".replace(" ** ", "^").replace(" * ", " ").replace(" / ", "/")


def _parse_in_context(unit: str, expected: str | None, name: str) -> "pint.Unit":
    if expected is None:
        return _parse("rpm" if unit.strip().replace(" ", "") in _PER_MINUTE else unit, name)
    target = _base(_parse(expected, f"the unit expected of {name}"))
    if unit.strip().replace(" ", "") in _PER_MINUTE and target == _base(_parse("rad/s", name)):
        return _parse("rpm", name)
    parsed = _parse(unit, name)
    if not _same_dimension(_base(parsed), target):
        raise InputError(
            f"{name} has the unit {unit!r}, which is {_describe(parsed)}, but {_describe(target)} is expected. "
            f"Give it in {expected!r} or another unit of that dimension{_hint(parsed, target)}."
        )
    return parsed


def _same_dimension(given: "pint.Unit", target: "pint.Unit") -> bool:
    if given == target:
        return True
    without_angle, target_without_angle = (_exponents(unit, skip="radian") for unit in (given, target))
    # N m and N m/rad are both written for a rotational stiffness; 1/s and rad/s are different things.
    return without_angle == target_without_angle and not set(without_angle) <= {"second"}


def _hint(given: "pint.Unit", target: "pint.Unit") -> str:
    if _exponents(_base(given), skip="radian") == _exponents(target, skip="radian"):
        return "; a frequency in Hz and a rotation in rad/s differ by 2 pi, say which is meant"
    return ""


def _describe(unit: "pint.Unit") -> str:
    base = _base(unit)
    dimension = " ".join(f"{key.strip('[]')}^{power:g}" for key, power in sorted(unit.dimensionality.items()))
    angle = _exponents(base).get("radian", 0)
    parts = [f"angle^{angle:g}"] if angle else []
    return (
        " ".join(parts + ([dimension] if dimension else [])).replace("^1 ", " ").removesuffix("^1") or "a plain number"
    )


def _exponents(unit: "pint.Unit", skip: str = "") -> dict[str, Any]:
    return {name: power for name, power in unit._units.items() if name != skip}


def _base(unit: "pint.Unit") -> "pint.Unit":
    return cast("pint.Unit", _registry().get_base_units(unit)[1])


def _parse(unit: str, name: str) -> "pint.Unit":
    text = unit.strip().replace("·", "*").replace("⋅", "*")
    if text.replace(" ", "") in _REVOLUTIONS_PER_MINUTE:
        text = "rpm"
    elif text.replace(" ", "") in _PER_MINUTE:
        text = "1/min"
    text = re.sub(r"(?<![^\W\d_])Ohm(?![^\W\d_])", "ohm", text.translate(_SUPERSCRIPTS))
    text = re.sub(r"(?<![^\W\d_])([cmkM]?)Nms(?![^\W\d_])", r"(\1N*m*s)", text)
    text = re.sub(r"(?<![^\W\d_])([cmkM]?)Nm(?![^\W\d_])", r"(\1N*m)", text)
    text = re.sub(r"(?<![^\W\d_])([mk]?)(N|V|A)(\^\d)?s(?![^\W\d_])", r"(\1\2\3*s)", text)
    try:
        if not text or "//" in text:
            raise ValueError("no unit, or a division that rounds")
        return _registry().parse_units(text)
    except Exception as error:  # pint raises anything from AssertionError to its own classes on a malformed unit
        raise InputError(
            f"{name} has the unit {unit!r}, which is not known. Write it like one of: m, mm/s, m/s^2, deg, rpm, 1/min, "
            'N, Nm, bar, V, A, Hz, or "1" for a plain number.'
        ) from error


@functools.cache
def _registry() -> "pint.UnitRegistry":
    import pint  # a second to import, so only where a unit is converted

    return pint.UnitRegistry()
