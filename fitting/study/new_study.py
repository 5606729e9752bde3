"""`drivetwin new`: a commented study file for a chosen drive."""

import importlib
import os
import pkgutil
import re
from pathlib import Path
from typing import Any

from fitting.study import drives
from fitting.study.channels import output_names
from twin._checks import InputError
from twin.io.model_text import model_text
from twin.io.toml_document import unknown

_EXAMPLE = r"^\[data\.(\w+)\]\n(.*?)(?=\n\n)\n\n\[data\.\1\.channels\][^\n]*\n(.*?)(?=\n\n)"
# What a look at a file calls a channel, and what the examples call it: the first that the example has.
_ALIASES = {
    "position_setpoint": ("set",),
    "current": ("command",),
    "current_setpoint": ("current", "command"),
    "voltage": ("command",),
    "voltage_setpoint": ("command",),
    "torque": ("command", "current"),
    "torque_setpoint": ("command", "current"),
    "position_2": ("load_position",),
    "velocity_2": ("load_velocity",),
}


def known_drives() -> dict[str, Any]:
    """Drives that a study file is written for, by name."""
    names = sorted(found.name for found in pkgutil.iter_modules(drives.__path__) if not found.name.startswith("_"))
    return {name.replace("_", "-"): importlib.import_module(f"{drives.__name__}.{name}") for name in names}


def new_study(drive: str, *, data: Path | None = None, folder: Path | None = None) -> str:
    """The text of a study file.

    Args:
        drive: name of the drive, as in `known_drives`.
        data: a file of measurements whose channels are to be listed; None for an example.
        folder: where the study file will lie, from which the path of the data counts; None for here.

    Raises:
        InputError: an unknown drive, or a file that cannot be read.
    """
    known = known_drives()
    name = drive.replace("_", "-")
    if name not in known:
        raise InputError(unknown("drive", drive, known))
    module = known[name]
    head = (
        f"# Study file of drivetwin: {module.HELP}.\n"
        "# Quantities are text with their unit, in any unit of the right dimension; keys are paths into the model.\n"
        "# Commands: drivetwin fit, rank, sweep, simulate, frf, modes, identify STUDY.toml; each reads its table.\n\n"
        f'[study]\ntitle = "{name}"\nseed = 1\n\n'
    )
    rest = module.REST
    if data is not None:
        rest = _with_channels(rest, data, folder or Path(), output_names(module.model()))
    return head + model_text(module.model()) + rest


def _with_channels(rest: str, data: Path, folder: Path, outputs: tuple[str, ...]) -> str:
    """The example's channels replaced by those of a file."""
    from twin.io.look import look
    from twin.io.measurement import read_measurement

    lines = look(read_measurement(data)).study.strip().split("\n")
    if 'kind = "frf"' in lines:
        return rest + "\n" + "\n".join(lines) + "\n"
    if not lines[0].startswith("[data."):
        raise InputError(f"{str(data)!r} has no channels over time. Look at it by: drivetwin look {data}")
    own = lines[0][len("[data.") : -1]
    block = re.search(_EXAMPLE, rest, re.MULTILINE | re.DOTALL)
    if block is None:
        return rest + "\n" + "\n".join(lines) + "\n"
    try:
        there = Path(os.path.relpath(data.resolve(), folder.resolve())).as_posix()
    except ValueError:  # on another drive of Windows
        there = data.resolve().as_posix()
    kept = [line for line in block.group(2).split("\n") if not line.startswith("file")]
    channels = _renamed(lines[lines.index(f"[data.{own}.channels]") + 1 :], block.group(3))
    times = [line for line in lines[1:] if line.startswith("time")]
    new = [f"[data.{block.group(1)}]", f'file = "{there}"', *times, *kept, ""]
    new += [f"[data.{block.group(1)}.channels]        # names on the left must be those of the model's outputs:"]
    new += [f"# {', '.join(outputs)}"]
    new += [f"# in the example: {line}" for line in block.group(3).split("\n")]
    named = {*outputs, *(line.split(" = ")[0] for line in block.group(3).split("\n"))}
    channels = [line if line.split(" = ")[0] in named else f"# not in the model: {line}" for line in channels]
    return rest[: block.start()] + "\n".join([*new, *channels]) + rest[block.end() :]


def _renamed(lines: list[str], example: str) -> list[str]:
    """The lines of a file's channels, called as the example calls them and with what else it says of them."""
    more = dict(re.findall(r"^(\w+) = \{.*?unit = \"[^\"]*\"(.*?) \}", example, re.MULTILINE))
    kept = {name: re.sub(r", deviation = \"[^\"]*\"", "", options) for name, options in more.items()}
    taken = {line.split(" = ")[0] for line in lines}
    found = []
    for line in lines:
        name, equals, rest = line.partition(" = ")
        if name not in kept:
            alias = next((one for one in _ALIASES.get(name, ()) if one in kept and one not in taken), name)
            taken.add(alias)
            name = alias
        found.append(f"{name}{equals}{rest.replace(' }', kept.get(name, '') + ' }', 1)}")
    return found
