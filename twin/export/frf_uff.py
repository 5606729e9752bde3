"""Frequency responses as universal files (dataset 58)."""

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from twin._checks import InputError, finite
from twin.frf import FRF
from twin.io._whole_file import whole_file
from twin.structure import DIRECTIONS

_FREQUENCY_RESPONSE, _FREQUENCY, _FORCE = 4, 18, 13
_MOTIONS = {"receptance": 8, "mobility": 11, "accelerance": 12}
_PLACE = re.compile(r"([1-9]\d{0,8}) (-?)(" + "|".join(DIRECTIONS) + ")")


def write_frf_uff(
    path: str | os.PathLike[str],
    frf: FRF,
    *,
    places: Mapping[str, str] | None = None,
    form: str | None = None,
    binary: bool = False,
    description: str = "",
) -> Path:
    """Write a frequency response as a universal file in SI units, whole or not at all.

    `twin.io.frf_uff.read_frf_uff` reads it again. The format keeps twelve digits of the values and six of the
    frequencies; a binary file keeps all.

    Args:
        path: the file; one that exists is replaced.
        frf: the response, in m/N or its like.
        places: node and direction of those responses and excitations that are not named so, such as
            `{"load_position": "2 rz"}`; "12 -x" for one that is measured against the direction.
        form: "receptance", "mobility" or "accelerance", where the response's own form is "ratio".
        binary: dataset 58b, with binary numbers.
        description: what it is, at most 80 characters of ASCII.

    Returns:
        Path of the file.

    Raises:
        InputError: a name without node and direction, two names at one place, no form that the format knows, values
            that are not finite, frequencies too close for the text format, a folder that does not exist.
    """
    import pyuff  # a second to import

    motion = _motion(frf, form)
    rows = _places("output", frf.outputs, places or {})
    columns = _places("input", frf.inputs, places or {})
    values, frequency = np.asarray(frf.values), np.asarray(frf.frequency)
    finite("values of the frequency response", np.abs(values))
    _check_text("description", description, 80)
    even = _is_even(frequency)
    if not (even or binary):
        _check_rounded(frequency)
    sets = [{"type": 164, "units_code": 1, "units_description": "SI", "temp_mode": 1}]
    sets[0] |= {"length": 1.0, "force": 1.0, "temp": 1.0, "temp_offset": 273.15}
    for i, (node, direction) in enumerate(rows):
        for j, (reference_node, reference_direction) in enumerate(columns):
            sign = np.sign(direction) * np.sign(reference_direction)
            one: dict[str, Any] = {"type": 58, "binary": int(binary), "func_type": _FREQUENCY_RESPONSE}
            one |= {"rsp_node": node, "rsp_dir": direction, "ref_node": reference_node, "ref_dir": reference_direction}
            one |= {"x": frequency, "data": sign * values[i, j], "abscissa_spacing": int(even)}
            one |= {"abscissa_spec_data_type": _FREQUENCY, "ordinate_spec_data_type": motion}
            one |= {"orddenom_spec_data_type": _FORCE, "id1": description or "NONE", "z_axis_value": 0.0}
            sets.append(one)
    with whole_file(path) as temporary:
        pyuff.UFF(str(temporary)).write_sets(sets, mode="overwrite")
        if binary:
            _correct_length(temporary, frequency.size, 2 if even else 3)
    return Path(path)


def _motion(frf: FRF, form: str | None) -> int:
    own = frf.form if form is None else form
    if frf.form != "ratio" and own != frf.form:
        raise InputError(f"form is {form!r}, but the response says that it is {frf.form!r}. Leave form out.")
    if own not in _MOTIONS:
        raise InputError(
            f"The response has the form {own!r}, which a universal file has no word for. Say what it is: "
            'form="receptance" for m/N, "mobility" for m/(Ns), "accelerance" for m/(Ns²).'
        )
    return _MOTIONS[own]


def _places(kind: str, names: tuple[str, ...], places: Mapping[str, str]) -> list[tuple[int, int]]:
    """Node number and signed direction of each name."""
    found: dict[tuple[int, int], str] = {}
    for name in names:
        place = places.get(name, name)
        match = _PLACE.fullmatch(place)
        if match is None:
            raise InputError(
                f"The {kind} {name!r} has no node and direction: {place!r} is not of the form '12 x'. Give its place: "
                f"places={{{name!r}: '1 x'}}, with a direction of {', '.join(DIRECTIONS)}."
            )
        at = int(match[1]), DIRECTIONS.index(match[3]) + 1
        if at in found:
            raise InputError(f"The {kind}s {found[at]!r} and {name!r} are both at {place!r}. Give them two places.")
        found[at] = name
    turned = [_PLACE.fullmatch(places.get(name, name)) for name in names]
    return [(node, -way if match and match[2] else way) for (node, way), match in zip(found, turned, strict=True)]


def _is_even(frequency: np.ndarray) -> bool:
    """Whether the first frequency and the step, as the file has them, give all the others back."""
    if frequency.size < 2:
        return False
    first, step = (float(f"{value:.5e}") for value in (frequency[0], frequency[1] - frequency[0]))
    return bool(np.allclose(first + np.arange(frequency.size) * step, frequency, rtol=1e-12, atol=0.0))


def _check_rounded(frequency: np.ndarray) -> None:
    rounded = np.array([float(f"{value:.5e}") for value in frequency])
    if np.any(np.diff(rounded) <= 0):
        raise InputError(
            "The frequencies are too close for the six digits that the text format has for them. Write binary=True."
        )


def _check_text(name: str, text: str, length: int) -> None:
    if not (text.isascii() and text.isprintable() and len(text) <= length):
        raise InputError(f"{name} must be one line of at most {length} ASCII characters, but is {text!r}. Shorten it.")


def _correct_length(file: Path, points: int, numbers: int) -> None:
    """pyuff counts the bytes of real, evenly spaced data; other readers go by this number."""
    wrong = b"%12i%6i%6i%12i%12i\n" % (points * 8, 0, 0, 0, 0)
    right = b"%12i%6i%6i%12i%12i\n" % (points * 8 * numbers, 0, 0, 0, 0)
    head = re.compile(rb"( {4}58b.{24})" + re.escape(wrong))
    file.write_bytes(head.sub(lambda match: match[1] + right, file.read_bytes()))
