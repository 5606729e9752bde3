"""Servo axis from position and command by least squares: no start, no simulation.

[identify]
procedure = "inverse_dynamics"
decimation = 10
"""

from pathlib import Path

import jax.numpy as jnp

from fitting.identification.inverse_dynamics import inverse_dynamics
from fitting.study.data import data_names, read_record
from fitting.study.free_parameters import without_prefix
from fitting.study.procedures._found import Found
from fitting.study.study_file import StudyFile
from twin.control import SampledLoop
from twin.drives import ServoAxis
from twin.io.toml_document import unknown
from twin.io.toml_table import TomlTable

HELP = "mass, friction and offset of a servo axis from its position and command, by least squares"
KEYS = ("decimation", "data")


def run(study: StudyFile, table: TomlTable, out: Path) -> Found:
    """Identify the free parameters of a servo axis.

    Args:
        study: the study; its model a `ServoAxis`, alone or in a loop.
        table: [identify].
        out: folder for the results; nothing of its own is written here.

    Raises:
        InputError: another model, no record with `position` and `command` or `force`, and as `inverse_dynamics`.
    """
    axis = study.model.plant if isinstance(study.model, SampledLoop) else study.model
    if not isinstance(axis, ServoAxis):
        raise table.error("procedure", f"inverse_dynamics is for a ServoAxis, but the model is {type(axis).__name__}.")
    names = data_names(study, "record")
    name = table.text("data", names[0] if names else None)
    if name not in names:
        raise table.error("data", unknown("record", name, names))
    record = read_record(study, name).record
    if "force" not in record.channels:
        force = jnp.asarray(axis.gain) * record.channel("command")
        record = record.with_channel("force", force, "N")
    space = study.space
    if axis is not study.model:
        space = without_prefix(space, "plant.")
    result = inverse_dynamics(record, axis, space, decimation=table.integer("decimation", 10))
    summary = {
        "parameters": {path: one._asdict() for path, one in result.estimates().items()},
        "status": result.message,
    }
    return Found(repr(result), summary, result)
