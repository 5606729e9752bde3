"""Which channels of a record are compared with what a model gives out, and which are not."""

from typing import Any

import jax
import jax.numpy as jnp

from fitting.study.study_file import StudyFile
from twin.io.toml_document import unknown
from twin.io.toml_table import TomlTable
from twin.plant import AbstractPlant
from twin.record import Record
from twin.references import AbstractReference


def compared_channels(
    study: StudyFile, table: TomlTable, record: Record, reference: AbstractReference | None
) -> tuple[str, ...]:
    """Names of the channels that are compared with what the model gives out.

    Args:
        study: the study.
        table: table of the data set.
        record: the record.
        reference: what drove the drive.

    Raises:
        InputError: an unknown name, or none that the model gives out.
    """
    outputs = output_names(study.model)
    if "compare" in table:
        names = tuple(channel_of(table, "compare", record, one) for one in table.texts("compare"))
        for name in names:
            if name not in outputs:
                raise table.error("compare", unknown("output", name, outputs))
        return names
    driven = set(table.table("inputs").values()) if "inputs" in table else {table.data.get("reference")}
    found = tuple(name for name in record.channels if name in outputs and name not in driven)
    if not found and reference is not None:
        raise table.error(
            "channels",
            f"none is named as an output of the model; these are {', '.join(outputs)}. Name the channels so.",
        )
    return found


def unused_channels(study: StudyFile, table: TomlTable, record: Record, compared: tuple[str, ...]) -> tuple[str, ...]:
    """A sentence on each channel that is neither compared nor drives nor starts the drive.

    Args:
        study: the study.
        table: table of the data set.
        record: the record.
        compared: names of the channels compared.
    """
    used = {*compared, table.data.get("reference")}
    used |= {
        one
        for key in ("inputs", "initial")
        if key in table
        for one in table.table(key).values()
        if isinstance(one, str)
    }
    left = tuple(one for one in output_names(study.model) if one not in compared)
    name = table.key[-1]
    return tuple(
        f"{name}: the channel {channel!r} is not used: {type(study.model).__name__} has no output of that name. "
        f"Rename it if it is one of these, which are not measured: {', '.join(left)}; else remove its line."
        for channel in record.channels
        if channel not in used and left
    )


def output_names(model: Any) -> tuple[str, ...]:
    """Names of what a model gives out.

    Args:
        model: a plant or a loop.
    """
    plant = model if isinstance(model, AbstractPlant) else model.plant
    state, inputs = plant.initial_state(), plant.rest_inputs()
    return jax.eval_shape(plant.outputs, jnp.zeros(()), state, inputs)._fields


def channel_of(table: TomlTable, name: str, record: Record, written: Any) -> str:
    """A channel of the record that a key names.

    Args:
        table: table of the data set.
        name: the key, for messages.
        record: the record.
        written: what stands there.

    Raises:
        InputError: no channel of that name.
    """
    if not isinstance(written, str) or written not in record.channels:
        raise table.error(name, unknown("channel", str(written), tuple(record.channels)))
    return written
