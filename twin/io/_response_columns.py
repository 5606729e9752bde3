"""Which columns of a table make responses, by what they are called: "real x/F", "imaginary x/F", "mag", "phase"."""

import re
from typing import Any

from twin._checks import InputError
from twin.io.measurement import Measurement

_KINDS = {
    "real": ("real", "re"),
    "imaginary": ("imaginary", "imag", "im"),
    "magnitude": ("magnitude", "mag", "amplitude", "amp", "abs", "gain", "betrag"),
    "phase": ("phase", "phi", "arg", "angle", "ang"),
    "deviation": ("deviation", "std", "sigma"),
    "variance": ("variance", "var"),
}
_NAMED = re.compile(
    rf"[|(]*\s*({'|'.join(word for words in _KINDS.values() for word in words)})(?![A-Za-z])[\s_.:(]*(.*?)[\s)|]*$",
    re.IGNORECASE,
)


def named_responses(found: Measurement) -> dict[tuple[str, str], dict[str, Any]]:
    """Columns of each response, as `ResponseChoice` takes them.

    What stands behind the kind names the response and, after a slash, the excitation.

    Args:
        found: a table.

    Raises:
        InputError: no response, or one that lacks a column.
    """
    groups: dict[str, dict[str, Any]] = {}
    for one in found:
        if one.values.dtype.kind == "c":
            groups.setdefault(one.name, {})["value"] = one.name
        elif match := _NAMED.match(one.name):
            kind = next(kind for kind, words in _KINDS.items() if match.group(1).lower() in words)
            if groups.setdefault(match.group(2), {}).setdefault(kind, one.name) != one.name:
                raise _unclear(found)
    whole = ({"value"}, {"real", "imaginary"}, {"magnitude", "phase"})
    if not groups or any(set(group) - {"deviation", "variance"} not in whole for group in groups.values()):
        raise _unclear(found)
    if len(groups) == 1:
        name, group = next(iter(groups.items()))
        return {_pair(name) if "/" in name else ("response", "excitation"): group}
    return {_pair(name): group for name, group in groups.items()}


def _pair(name: str) -> tuple[str, str]:
    output, _, excitation = name.partition("/")
    return output.strip() or "response", excitation.strip() or "excitation"


def _unclear(found: Measurement) -> InputError:
    return InputError(
        f"The columns of {found.source!r} do not tell which responses they are: {', '.join(map(repr, found.names))}. "
        'Call them "real x/F" and "imaginary x/F", or "mag x/F" and "phase x/F"; or name them by '
        "responses={('response', 'excitation'): ResponseChoice(...)}."
    )
