"""Frequency responses of a study file: measured ones, or estimated from a record.

[data.taps]
kind = "frf"
file = "taps.uff"
band = ["5 Hz", "300 Hz"]
outputs = { position = "motor_angle" }     # the model's name = the measured name
inputs = { command = "current" }
"""

import dataclasses

import jax.numpy as jnp
import numpy as np

from fitting.study.model_modes import MovingResponse
from fitting.study.operating_point import KEYS, operating_point
from fitting.study.study_file import StudyFile
from twin._checks import InputError
from twin.frf import FRF, local_polynomial_variance
from twin.io.quantity import parse_quantity
from twin.io.toml_document import unknown
from twin.io.toml_table import TomlTable

_KNOWN = ("kind", "file", "format", "read", "band", "outputs", "inputs", "residual", "variance", *KEYS)


@dataclasses.dataclass(frozen=True)
class ResponseData:
    """A measured frequency response, and what of it belongs to which output and input of the model."""

    name: str
    """Name of the data set."""
    measured: FRF
    """The response with its variance; outputs and inputs as measured."""
    outputs: tuple[str, ...]
    """The model's names of the outputs, in order."""
    inputs: tuple[str, ...]
    """The model's names of the inputs, in order."""
    residual: str
    """"log" or "complex", see `FrequencyResponseResidual`."""
    respond: MovingResponse
    """From a model and frequencies [Hz] to its response, at the operating point of the measurement."""
    remarks: tuple[str, ...]
    """What was assumed."""


def read_response(study: StudyFile, name: str) -> ResponseData:
    """Read one data set of a study that is a frequency response.

    Args:
        study: the study.
        name: name of the data set.

    Raises:
        InputError: naming the line and key of the study file, or what is wrong with the data file.
    """
    table = study.table("data", name, known=_KNOWN, required=True)
    from twin.io.frf_table import read_frf

    path = table.document.folder / table.text("file")
    options = dict(table.table("read"))
    if "format" in table:
        options["format"] = table.text("format")
    try:
        frf = read_frf(path, **options)
        if "band" in table:
            frf = frf.between(*_band(table))
    except InputError as error:
        raise table.error("", str(error)) from error
    rows, columns = _named(table, "outputs", frf.outputs), _named(table, "inputs", frf.inputs)
    frf = _part(frf, tuple(rows.values()), tuple(columns.values()))
    remarks = []
    if frf.variance is None or table.text("variance", "measured", choices=("measured", "scatter")) == "scatter":
        frf = frf.with_variance(_scatter(frf, table))
        remarks.append(f"{name}: variance of the response read from the scatter of neighbouring lines.")
    kind = table.text("residual", "log", choices=("log", "complex"))
    model = study.model if "model" in study.document.data else None  # some procedures need none
    respond = MovingResponse(operating_point(table, model))
    return ResponseData(name, frf, tuple(rows), tuple(columns), kind, respond, tuple(remarks))


def _band(table: TomlTable) -> tuple[float, float]:
    written = table.data["band"]
    if not isinstance(written, list) or len(written) != 2:
        raise table.error("band", f'must be the lowest and highest frequency, ["5 Hz", "300 Hz"], but is {written!r}.')
    low, high = (parse_quantity(one, ("Hz",), name="band").value for one in written)
    return low, high


def _named(table: TomlTable, key: str, measured: tuple[str, ...]) -> dict[str, str]:
    """The measured name of each of the model's; all, under their own names, where the file says nothing."""
    named = table.table(key) or {name: name for name in measured}
    for model, name in named.items():
        if name not in measured:
            raise table.document.error((*table.key, key, model), unknown(f"one of the {key}", str(name), measured))
    return named


def _part(frf: FRF, outputs: tuple[str, ...], inputs: tuple[str, ...]) -> FRF:
    index = np.ix_([frf.outputs.index(o) for o in outputs], [frf.inputs.index(i) for i in inputs])
    variance = None if frf.variance is None else frf.variance[index]
    return FRF(frf.frequency, frf.values[index], outputs, inputs, frf.form, variance)


def _scatter(frf: FRF, table: TomlTable) -> jnp.ndarray:
    try:
        variance = local_polynomial_variance(frf)
    except InputError as error:
        raise table.error("", str(error)) from error
    # A computed response does not scatter; its lines then count alike, relative to their size.
    return jnp.maximum(variance, (1e-6 * jnp.abs(frf.values)) ** 2)
