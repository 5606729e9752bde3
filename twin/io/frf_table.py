"""Frequency responses from tables: delimited text, MAT, HDF5 and whatever else has a frequency column; or UFF."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import jax.numpy as jnp
import numpy as np

from twin._checks import InputError
from twin.frf import FRF
from twin.io._files import existing_file
from twin.io._response_columns import named_responses
from twin.io.formats import universal
from twin.io.measurement import MeasuredChannel, Measurement, read_measurement
from twin.io.units import to_si


@dataclass(frozen=True)
class ResponseChoice:
    """Which columns make one response: complex, or real and imaginary part, or magnitude and phase."""

    value: str | None = None
    """Column of complex values."""
    real: str | None = None
    """Column of the real part."""
    imaginary: str | None = None
    """Column of the imaginary part."""
    magnitude: str | None = None
    """Column of the magnitude."""
    phase: str | None = None
    """Column of the phase."""
    unit: str | None = None
    """Unit of the values, such as "um/N"; None takes the file's, and 1 where it says nothing."""
    expected: str | None = None
    """A unit of the dimension the response must have, such as "m/N"; None takes any."""
    decibel: bool = False
    """Whether the magnitude is in dB (20 lg) of that unit; a column whose unit is dB is taken so by itself."""
    phase_unit: Literal["deg", "rad"] | None = None
    """Unit of the phase; None takes the file's, and deg where it says nothing."""
    deviation: str | None = None
    """Column of the standard deviation of the complex value, in the same unit."""
    variance: str | None = None
    """Column of its square instead."""
    coherence: str | None = None
    """Column of the coherence γ²; with `averages` it gives the variance |G|²(1-γ²)/(γ² averages)."""
    averages: int | None = None
    """Number of independent averages behind the coherence."""


def read_frf(
    path: str | os.PathLike[str],
    responses: Mapping[tuple[str, str], ResponseChoice] | None = None,
    *,
    form: str = "ratio",
    frequency: str | None = None,
    frequency_unit: str | None = None,
    format: str | None = None,
    **options: Any,
) -> FRF:
    """Read frequency responses.

    Args:
        path: a table with a column of frequencies, or a universal file.
        responses: for each pair (response, excitation) its columns; every response must be given for every excitation.
            None for a universal file, or for a table whose columns name themselves: complex; "real x/F" and
            "imaginary x/F"; "mag x/F" and "phase x/F"; the names may be left out where there is one response.
        form: "receptance", "mobility", "accelerance" or "ratio".
        frequency: name of the column of frequencies; None finds it.
        frequency_unit: its unit, such as "Hz" or "rad/s"; None takes the file's, and Hz where it says nothing.
        format: name of the format; None finds it.
        options: those of the format's reader.

    Returns:
        The response in SI; with a variance if every response has a deviation, or a coherence and a number of averages.

    Raises:
        InputError: a file that cannot be read, columns that are missing, too many or of different lengths, frequencies
            that do not increase, a unit that is unknown or unlike the one expected.
    """
    file = existing_file(path, "File of responses")
    with file.open("rb") as opened:
        head = opened.read(200)
    if responses is None and (format == "universal" or universal.matches(head)):
        from twin.io.frf_uff import read_frf_uff

        return read_frf_uff(file)
    found = read_measurement(path, format=format, **options)
    axis = _frequencies(found, frequency, frequency_unit)
    chosen = (
        dict(responses)
        if responses is not None
        else {pair: ResponseChoice(**columns) for pair, columns in named_responses(found).items()}
    )
    outputs = tuple(dict.fromkeys(output for output, _ in chosen))
    inputs = tuple(dict.fromkeys(excitation for _, excitation in chosen))
    values = np.empty((len(outputs), len(inputs), axis.size), dtype=complex)
    variance = np.full(values.shape, np.nan)
    for row, output in enumerate(outputs):
        for column, excitation in enumerate(inputs):
            if (output, excitation) not in chosen:
                raise InputError(f"responses lacks {(output, excitation)}. Give every response for every excitation.")
            label = f"response {output!r} to {excitation!r} of {found.source!r}"
            values[row, column], variance[row, column] = _response(found, chosen[output, excitation], axis.size, label)
    known = None if np.all(np.isnan(variance)) else jnp.asarray(variance)
    if known is not None and np.any(np.isnan(variance)):
        raise InputError(f"Some responses of {found.source!r} have a variance and others none. Give all, or none.")
    return FRF(jnp.asarray(axis), jnp.asarray(values), outputs, inputs, form=form, variance=known)


def _frequencies(found: Measurement, name: str | None, unit: str | None) -> np.ndarray:
    if name is not None and name in found.names:
        column, own = found[name].values, found[name].unit
    else:
        axis = next((one for one in found if one.abscissa == "frequency" and one.times is not None), None)
        if axis is None or axis.times is None or name is not None:
            raise InputError(
                f"{found.source!r} has no column of frequencies{'' if name is None else f' {name!r}'}; it has "
                f"{', '.join(map(repr, found.names))}. Name it by frequency."
            )
        column, own = axis.times, "Hz"
    unit = unit or own or "Hz"
    if unit.replace(" ", "") in ("rad/s", "1/s", "s^-1"):
        return column / (2 * np.pi)
    return to_si(column, unit, "Hz", name=f"frequencies of {found.source!r}")


def _response(found: Measurement, choice: ResponseChoice, size: int, label: str) -> tuple[np.ndarray, np.ndarray]:
    def column(name: str) -> MeasuredChannel:
        one = found[name]
        if one.values.size != size:
            raise InputError(f"{label}: column {name!r} has {one.values.size} values for {size} frequencies. Check it.")
        return one

    named = (choice.value, choice.real, choice.imaginary, choice.magnitude, choice.phase)
    given = tuple(name is not None for name in named)
    if choice.value is not None and given == (True, False, False, False, False):
        first = column(choice.value)
        values = first.values.astype(complex)
    elif choice.real and choice.imaginary and given == (False, True, True, False, False):
        first = column(choice.real)
        values = first.values + 1j * column(choice.imaginary).values
    elif choice.magnitude and choice.phase and given == (False, False, False, True, True):
        first, phase = column(choice.magnitude), column(choice.phase)
        size_of = 10 ** (first.values / 20) if choice.decibel or first.unit.lower() == "db" else first.values
        angle = to_si(phase.values, choice.phase_unit or phase.unit or "deg", "rad", name=f"phase of {label}")
        values = size_of * np.exp(1j * angle)
    else:
        raise InputError(f"{label} needs value, or real and imaginary, or magnitude and phase, and no mixture.")
    unit = choice.unit or (first.unit if first.unit.lower() != "db" else "") or "1"
    factor = float(to_si(1.0, unit, choice.expected, name=label))
    return factor * values, factor**2 * _variance(values, choice, column, label)


def _variance(values: np.ndarray, choice: ResponseChoice, column: Any, label: str) -> np.ndarray:
    if choice.deviation is not None:
        return column(choice.deviation).values ** 2
    if choice.variance is not None:
        return column(choice.variance).values
    if choice.coherence is None:
        return np.full(values.shape, np.nan)
    coherence = column(choice.coherence).values
    if choice.averages is None or choice.averages < 2:
        raise InputError(f"{label} has a coherence, but averages is {choice.averages}. Give the number of averages.")
    if not np.all((coherence > 0) & (coherence <= 1)):
        raise InputError(f"{label} has a coherence outside 0 to 1. Check the column; it must be γ², not in percent.")
    # Bendat and Piersol, Random Data, 4th ed., Eq. 9.90: both parts together.
    return np.abs(values) ** 2 * (1 - coherence) / (coherence * choice.averages)
