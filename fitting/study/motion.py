"""What a study lets a model do without data: a reference or constant inputs over some time.

[simulate]
duration = "1 s"
rate = "4 kHz"
reference = { type = "JerkLimitedMove", distance = "0.2 m", velocity_limit = "0.5 m/s", ... }
inputs = { command = "2 A" }        # for a drive without a loop, from time 0 on
data = "run1"                       # or: as in this record
"""

import dataclasses
from typing import Any

import jax.numpy as jnp
import numpy as np

from fitting.study.data import data_names, read_record, signal_of
from fitting.study.study_file import StudyFile
from twin._checks import InputError
from twin.control import SampledLoop
from twin.io.model_table import build_model
from twin.io.quantity import parse_quantity
from twin.io.toml_document import unknown
from twin.paths import set_leaves
from twin.plant import AbstractPlant
from twin.references import AbstractReference

_KEYS = ("duration", "rate", "reference", "inputs", "hold", "data", "start")
_MOST = 5_000_000


@dataclasses.dataclass(frozen=True)
class Motion:
    """What a model is to do."""

    model: Any
    """The model, starting where it is to start."""
    reference: AbstractReference
    """What drives it."""
    times: np.ndarray
    """Times at which it is wanted (times,) [s]."""
    measured: dict[str, np.ndarray]
    """Channels of the record that it follows, if any, SI."""


def read_motion(study: StudyFile) -> Motion:
    """The motion that [simulate] describes.

    Args:
        study: the study.

    Raises:
        InputError: naming line and key: no reference, one that does not suit the model, no duration, too many samples.
    """
    table = study.table("simulate", known=_KEYS)
    records = data_names(study, "record")
    if "data" in table or (not table.data and records):
        name = table.text("data", records[0] if records else None)
        if name not in records:
            raise table.error("data", unknown("data set", name, records))
        one = read_record(study, name)
        if one.reference is None:
            raise study.document.error(("data", name), "does not say what drove it: give `reference` or `inputs`.")
        model = set_leaves(study.model, dict(one.initial)) if one.initial else study.model
        channels = {channel: np.asarray(values) for channel, values in one.record.channels.items()}
        return Motion(model, one.reference, np.asarray(one.record.times), channels)
    model = study.model
    times = _times(table, model)
    if "reference" in table:
        if isinstance(model, AbstractPlant) and "command" in model.rest_inputs()._fields:
            raise table.error(
                "reference",
                f"{type(model).__name__} has no controller to follow one. Give `inputs`, or a loop.",
            )
        reference = build_model(study.document, ("simulate", "reference"), kind=AbstractReference)
        return Motion(model, reference, times, {})
    if "inputs" in table:
        if not isinstance(model, AbstractPlant):
            raise table.error("inputs", f"{type(model).__name__} follows a `reference`.")
        values = {}
        for path, written in table.table("inputs").items():
            try:
                level = parse_quantity(written, name=path).value
            except InputError as error:
                raise study.document.error(("simulate", "inputs", path), str(error)) from error
            values[path] = jnp.full(2, level)
        return Motion(model, signal_of(table, model, np.asarray([times[0], times[-1]]), values), times, {})
    raise table.error(
        "",
        "does not say what the model is to do. Give `reference` (for a loop), `inputs` (for a drive), or `data`, the "
        "name of a record.",
    )


def _times(table: Any, model: Any) -> np.ndarray:
    start = table.quantity("start", "0 s", units=("s",)).value
    duration = table.quantity("duration", units=("s",), positive=True).value
    if isinstance(model, SampledLoop):
        if "rate" in table:
            raise table.error("rate", "is that of the controller, its period, and is not given again.")
        step = float(model.period)
    else:
        step = 1 / table.quantity("rate", "1 kHz", units=("Hz",), positive=True).value
    count = round(duration / step) + 1
    if not 8 <= count <= _MOST:
        raise table.error("duration", f"makes {count} samples, but 8 to {_MOST} are possible. Change duration or rate.")
    return start + step * np.arange(count)
