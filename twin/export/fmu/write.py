"""A system as an FMU file."""

import hashlib
import os
import re
import tempfile
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path

from twin._checks import InputError
from twin.control.closed_loop import SampledLoop
from twin.export import c_code
from twin.export.fmu.compile import TARGETS, compile_library, this_platform
from twin.export.fmu.description import build_description, model_description, source_names
from twin.export.fmu.model_source import model_header, model_source
from twin.export.fmu.variables import layout
from twin.export.one_step import one_step
from twin.io._whole_file import whole_file
from twin.plant import AbstractPlant
from twin.stepping import AbstractStepping

_VERSIONS = ("2.0", "3.0")
# The first day that a ZIP file knows: with no date of its own, the same model gives the same file.
_DATE = (1980, 1, 1, 0, 0, 0)


def write_fmu(
    path: str | os.PathLike[str],
    system: AbstractPlant | SampledLoop,
    *,
    period: float | None = None,
    stepping: AbstractStepping | None = None,
    version: str = "3.0",
    parameters: Iterable[str] | None = None,
    rename: Mapping[str, str] | None = None,
    platforms: Iterable[str] | None = None,
    name: str | None = None,
    description: str = "",
) -> Path:
    """Write a system as an FMU for co-simulation, which runs without Python.

    It makes the same constant steps as `simulate`, its inputs held over each period. Communication steps are any whole
    number of periods. Variables:

    - inputs `input.command`, `input.load`, ... of a plant (of a closed loop `input.position`, ...); of a sampled loop
      `reference.position`, ... and, added to the plant's inputs, `injection.command`, ...;
    - outputs by the names of the plant's outputs, for the inputs that are set;
    - parameters by their dotted paths; those that the steps use can be changed between steps ("tunable");
    - `initial.STATE`, the plant's state at the start, as far as no parameter says what it is; `state.STATE` to look at.

    A parameter that is infinite, as a limit that is not there, stays so. Units are those in the docstrings of the
    model; where these leave a choice, as for an axis that may be linear or rotary, there is none.

    Args:
        path: the file, ending in .fmu; one that exists is replaced.
        system: a plant, driven openly or in a closed loop; or a sampled loop without injection.
        period: length of the step [s]; of a sampled loop its own.
        stepping: constant steps, 4 to a period by default; `choose_substeps` finds how many are enough.
        version: "2.0" or "3.0" of the standard.
        parameters: dotted paths of the parameters of the FMU, or of parts of the system; all finite numbers if not
            given. What is not a parameter is a constant, which makes a smaller and faster library.
        rename: other names for variables, by name, such as `{"input.command": "u"}`.
        platforms: "linux64", "win64", "darwin64", "aarch64-linux", "aarch64-darwin"; this machine's if not given.
            Others than this machine's need zig (`pip install ziglang`). None at all, `()`, for a source-code FMU.
        name: name of the model; that of the file if not given.
        description: what the model is.

    Returns:
        Path of the file. The same system gives the same file, byte for byte, from the same compiler.

    Raises:
        InputError: 64-bit mode off, adaptive stepping, a period that is missing or not the loop's, an unknown path,
            version or platform, two variables of one name, an operation that has no translation to C, no compiler, a
            wrong ending, a folder that does not exist.
    """
    file = Path(path)
    if file.suffix.lower() != ".fmu":
        raise InputError(f"{str(file)!r} must end in .fmu. Simulation tools know FMUs by it.")
    if version not in _VERSIONS:
        raise InputError(f'version must be "2.0" or "3.0", but is {version!r}. Choose one of the two.')
    wanted = (this_platform(),) if platforms is None else tuple(platforms)
    for one in wanted:
        if one not in TARGETS:
            raise InputError(f"platforms names {one!r}, but knows {', '.join(TARGETS)}. Choose among these.")
    step = one_step(system, period=period, stepping=stepping, parameters=parameters)
    places = layout(step, rename or {})
    title = file.stem if name is None else name
    identifier = re.sub(r"\W", "_", title, flags=re.ASCII)
    identifier = f"m_{identifier}" if not identifier[:1].isalpha() else identifier

    def describe(token: str) -> str:
        return model_description(version, title, identifier, token, places, step.period, description)

    sources = {"model.c": model_source(step, places)}
    for source in (*Path(__file__).parent.glob("*.[ch]"), *Path(c_code.__file__).parent.glob("*.h")):
        if source.name[:3] != "fmi" or source.name == f"fmi{version[0]}.c":
            sources[source.name] = source.read_text(encoding="utf-8")
    token = _token(*sorted(sources.values()), model_header(step, places, ""), describe(""))
    sources["model.h"] = model_header(step, places, token)
    content = {"modelDescription.xml": describe(token).encode()}
    content |= {f"sources/{name}": text.encode() for name, text in sources.items()}
    if version == "3.0":
        content["sources/buildDescription.xml"] = build_description(version, identifier).encode()
    with whole_file(file) as temporary:
        for one in wanted:
            target = TARGETS[one]
            folder = target.folder_2 if version == "2.0" else target.folder_3
            library = identifier + target.ending
            content[f"binaries/{folder}/{library}"] = _library(sources, source_names(version), library, one)
        _pack(temporary, content)
    return file


def _token(*texts: str) -> str:
    """The same for the same content, in the form of a GUID."""
    digits = hashlib.sha256("\0".join(texts).encode()).hexdigest()
    return f"{{{digits[:8]}-{digits[8:12]}-{digits[12:16]}-{digits[16:20]}-{digits[20:32]}}}"


def _library(sources: dict[str, str], compiled: tuple[str, ...], library: str, target: str) -> bytes:
    with tempfile.TemporaryDirectory() as place:
        for name, text in sources.items():
            (Path(place) / name).write_text(text, encoding="utf-8", newline="\n")
        compile_library(Path(place), compiled, library, target)
        return (Path(place) / library).read_bytes()


def _pack(file: Path, content: dict[str, bytes]) -> None:
    with zipfile.ZipFile(file, "w") as out:
        for name in sorted(content):
            entry = zipfile.ZipInfo(name, _DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            out.writestr(entry, content[name])
