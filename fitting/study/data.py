"""The data of a study file: records over time, with what drove the drive, and frequency responses.

[data.run1]
file = "axis.csv"
reference = "set"                                        # a closed loop follows this channel
initial = { "plant.initial_position" = "position" }      # the first sample of a channel
[data.run1.channels]
position = { column = "x_ist", unit = "mm", deviation = "1 um" }
set = { column = "x_soll", unit = "mm" }
"""

import dataclasses
from typing import Any, cast

import jax
import jax.numpy as jnp
import numpy as np

from fitting.study.channels import channel_of, compared_channels, unused_channels
from fitting.study.limits import limit_warnings
from fitting.study.noise import noise_deviation
from fitting.study.study_file import StudyFile
from twin._checks import InputError
from twin.io.model_table import build_model
from twin.io.model_types import unit_of_leaf
from twin.io.quantity import parse_quantity
from twin.io.toml_document import unknown
from twin.io.toml_table import TomlTable
from twin.paths import get_leaf
from twin.plant import AbstractPlant
from twin.record import Record
from twin.references import AbstractReference, SampledReference, SampledSignal
from twin.stepping import AbstractStepping

_RECORD = ("kind", "file", "format", "read", "time", "start", "stop", "rate", "gaps", "channels")
_DRIVEN = ("reference", "inputs", "hold", "initial", "compare")
_CHANNEL = ("column", "unit", "expected", "sign", "offset", "delay", "detrend", "scale", "deviation", "from_zero")


@dataclasses.dataclass(frozen=True)
class RecordData:
    """A record, what drove the drive meanwhile, and what of it is compared."""

    name: str
    """Name of the data set."""
    record: Record
    """The record, in SI."""
    reference: AbstractReference | None
    """What drove the drive; None where the file does not say."""
    initial: dict[str, float]
    """Numbers of the model that this record begins with, by path, in SI."""
    deviation: dict[str, float]
    """Standard deviation of the noise of each channel compared, SI."""
    remarks: tuple[str, ...]
    """What was assumed or changed on the way."""
    noise_read: tuple[str, ...] = ()
    """Channels whose noise nobody gave: it was read from the record."""
    warnings: tuple[str, ...] = ()
    """What was probably not meant so."""
    stepping: AbstractStepping | None = None
    """How time is stepped along it; None for what suits the model."""


def read_record(study: StudyFile, name: str) -> RecordData:
    """Read one data set of a study that is a record.

    Args:
        study: the study.
        name: name of the data set.

    Raises:
        InputError: naming the line and key of the study file, or what is wrong with the data file.
    """
    table = study.table("data", name, known=(*_RECORD, *_DRIVEN), required=True)
    _ = study.model  # its own errors come first
    record, remarks = _measured(table, name)
    reference = _reference(study, table, record)
    initial = _initial(study, table, record)
    compared = compared_channels(study, table, record, reference)
    warnings = limit_warnings(study.model, record, name) if reference is not None else ()
    warnings += () if "compare" in table else unused_channels(study, table, record, compared)
    deviation, read = {}, []
    for channel in compared:
        options = table.data["channels"].get(channel, {})
        written = options.get("deviation") if isinstance(options, dict) else None
        if written is None:
            read.append(channel)
            deviation[channel] = noise_deviation(np.asarray(record.channel(channel)))
            remarks.append(
                f"{name}: noise of {channel} read from the record itself, {deviation[channel]:.3g} "
                f"{record.units[channel]}; give `deviation` if you know it better."
            )
            continue
        unit = record.units[channel]
        quantity = _for_channel(table, channel, "deviation", lambda w=written, u=unit: parse_quantity(w, (u,)))
        deviation[channel] = quantity.value
        if not quantity.value > 0:
            raise study.document.error(
                (*table.key, "channels", channel, "deviation"), f"must be positive, but is {written!r}."
            )
    if "inputs" in table:
        held = table.flag("hold", False)
        remarks.append(
            f"{name}: inputs are {'held from sample to sample' if held else 'straight between samples'}; "
            f"{'hold = false' if held else 'hold = true'} is for {'measured, continuous' if held else 'digital'} ones."
        )
    return RecordData(name, record, reference, initial, deviation, tuple(remarks), tuple(read), warnings)


def data_names(study: StudyFile, kind: str) -> tuple[str, ...]:
    """Names of the data sets of a kind.

    Args:
        study: the study.
        kind: "record" or "frf".

    Raises:
        InputError: a data set of an unknown kind.
    """
    found = []
    for name, entry in study.document.table(("data",)).items():
        if not isinstance(entry, dict):
            raise study.document.error(("data", name), f"must be a table [data.{name}] with a file, but is {entry!r}.")
        own = entry.get("kind", "record")
        if own not in ("record", "frf"):
            raise study.document.error(("data", name, "kind"), unknown("kind", str(own), ("record", "frf")))
        if own == kind:
            found.append(name)
    return tuple(found)


def _measured(table: TomlTable, name: str) -> tuple[Record, list[str]]:
    from twin.io.measurement import read_measurement
    from twin.io.prepare import ChannelChoice, prepare

    path = table.document.folder / table.text("file")
    options = dict(table.table("read"))
    if "format" in table:
        options["format"] = table.text("format")
    choices = {}
    for channel, entry in table.table("channels").items():
        key = (*table.key, "channels", channel)
        if isinstance(entry, str):
            choices[channel] = ChannelChoice(entry)
            continue
        one = TomlTable(table.document, key, _CHANNEL)
        choices[channel] = ChannelChoice(
            column=one.text("column", channel),
            unit=_unit(one),
            expected=one.text("expected") if "expected" in one else None,
            sign=one.quantity("sign", 1, units=("1",)).value,
            offset=one.quantity("offset").value if "offset" in one else 0.0,
            delay=one.quantity("delay", "0 s", units=("s",)).value,
            detrend=cast(Any, one.text("detrend", "none", choices=("none", "mean", "linear"))),
            scale=one.quantity("scale").value if "scale" in one else None,
        )
    if not choices:
        raise table.error(
            "channels",
            f"names no channel. Add [data.{name}.channels] with lines like "
            'position = { column = "x", unit = "mm" }; drivetwin look FILE writes them.',
        )
    limits: dict[str, Any] = {key: table.quantity(key, units=("s",)).value for key in ("start", "stop") if key in table}
    if "rate" in table:
        limits["rate"] = table.quantity("rate", units=("Hz",), positive=True).value
    try:
        measurement = read_measurement(path, **options)
        prepared = prepare(
            measurement,
            choices,
            time=table.text("time") if "time" in table else None,
            gaps=cast(Any, table.text("gaps", "refuse", choices=("refuse", "fill", "longest"))),
            name=name,
            **limits,
        )
    except InputError as error:
        raise table.error("", str(error)) from error
    record = prepared.record
    for channel, entry in table.table("channels").items():
        if isinstance(entry, dict) and TomlTable(table.document, (*table.key, "channels", channel), _CHANNEL).flag(
            "from_zero", False
        ):
            values = record.channel(channel)
            record = record.with_channel(channel, values - values[0], record.units[channel])
    return record, [f"{name}: {remark}" for remark in prepared.remarks]


def _unit(channel: TomlTable) -> str | None:
    if channel.data.get("unit") == "":
        raise channel.error("unit", 'is empty. Fill in the unit of the column, such as "A"; "1" for a plain number.')
    return channel.text("unit") if "unit" in channel else None


def _reference(study: StudyFile, table: TomlTable, record: Record) -> AbstractReference | None:
    if "reference" in table and "inputs" in table:
        raise table.error("inputs", "stands beside `reference`. A closed loop follows a reference, a drive has inputs.")
    if "reference" in table:
        written = table.data["reference"]
        if isinstance(written, dict):
            return build_model(study.document, (*table.key, "reference"), kind=AbstractReference)
        channel = channel_of(table, "reference", record, written)
        return SampledReference(record.times, record.channel(channel))
    if "inputs" in table:
        if not isinstance(study.model, AbstractPlant):
            raise table.error("inputs", f"{type(study.model).__name__} takes none. Give `reference`, what it follows.")
        named = {path: channel_of(table, "inputs", record, channel) for path, channel in table.table("inputs").items()}
        return signal_of(table, study.model, record.times, {p: record.channel(c) for p, c in named.items()})
    return None


def signal_of(table: TomlTable, plant: AbstractPlant, times: Any, values: dict[str, Any]) -> SampledSignal:
    """Inputs of a plant from samples of some of them, the others at rest.

    Args:
        table: where they are written, for messages; its key `hold` says whether samples are held.
        plant: the plant.
        times: times [s].
        values: samples by path into the plant's inputs, "command" or "command.motor_1".

    Raises:
        InputError: a path that is no input.
    """
    rest = plant.rest_inputs()
    names = _input_names(rest)
    for path in values:
        if path not in names:
            raise table.error("inputs", unknown("input", path, names))
    zeros = jnp.zeros(len(times))
    columns = [jnp.asarray(values.get(name, zeros)) for name in names]
    tree = jax.tree.unflatten(jax.tree.structure(rest), columns)
    return SampledSignal(times, tree, interpolation="hold" if table.flag("hold", False) else "linear")


def _input_names(rest: Any) -> tuple[str, ...]:
    from twin._tree_names import leaf_name

    return tuple(leaf_name(keys) for keys, _ in jax.tree_util.tree_leaves_with_path(rest))


def _initial(study: StudyFile, table: TomlTable, record: Record) -> dict[str, float]:
    found = {}
    for path, written in table.table("initial").items():
        key = (*table.key, "initial", path)
        try:
            get_leaf(study.model, path)
            if isinstance(written, str) and written in record.channels:
                found[path] = float(record.channel(written)[0])
            else:
                found[path] = parse_quantity(written, unit_of_leaf(study.model, path), name=path).value
        except InputError as error:
            raise study.document.error(key, str(error)) from error
    return found


def _for_channel(table: TomlTable, channel: str, name: str, make: Any) -> Any:
    try:
        return make()
    except InputError as error:
        raise table.document.error((*table.key, "channels", channel, name), str(error)) from error
