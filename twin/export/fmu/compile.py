"""C compilers: which one there is, and how it makes a library that looks the same every time."""

import importlib.util
import os
import platform
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from twin._checks import InputError

# No contraction of products and sums into one operation: results are then the same on every machine.
_FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fno-strict-aliasing", "-shared", "-s")
_HERE = {("Linux", "x86_64"): "linux64", ("Windows", "AMD64"): "win64", ("Darwin", "x86_64"): "darwin64"}
_HERE |= {("Linux", "aarch64"): "aarch64-linux", ("Darwin", "arm64"): "aarch64-darwin"}


@dataclass(frozen=True)
class Target:
    """A kind of machine that an FMU can run on."""

    folder_2: str
    """Folder of its library in FMI 2."""
    folder_3: str
    """Folder of its library in FMI 3."""
    ending: str
    """Ending of a library."""
    zig: str
    """What zig calls it."""


TARGETS = {
    "linux64": Target("linux64", "x86_64-linux", ".so", "x86_64-linux-gnu"),
    "win64": Target("win64", "x86_64-windows", ".dll", "x86_64-windows-gnu"),
    "darwin64": Target("darwin64", "x86_64-darwin", ".dylib", "x86_64-macos"),
    "aarch64-linux": Target("aarch64-linux", "aarch64-linux", ".so", "aarch64-linux-gnu"),
    "aarch64-darwin": Target("aarch64-darwin", "aarch64-darwin", ".dylib", "aarch64-macos"),
}


def this_platform() -> str:
    """The platform that this Python runs on, by its name in `TARGETS`.

    Raises:
        InputError: if it is none of these.
    """
    here = platform.system(), platform.machine()
    if here not in _HERE:
        raise InputError(
            f"This machine ({' '.join(here)}) is none that libraries are built for: {', '.join(TARGETS)}. Write a "
            "source-code FMU by platforms=()."
        )
    return _HERE[here]


def compile_library(folder: Path, sources: tuple[str, ...], output: str, target: str) -> None:
    """Compile C files to a library.

    Args:
        folder: where the sources lie; the library is put there.
        sources: their names.
        output: name of the library.
        target: one of `TARGETS`.

    Raises:
        InputError: no compiler for this platform, or one that fails.
    """
    command = [*_compiler(target), *_FLAGS]
    command += [] if target == "win64" else ["-fPIC", "-fvisibility=hidden"]
    command += ["-o", output, *sources, *([] if target == "win64" else ["-lm"])]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise InputError(
            f"The C compiler {command[0]!r} failed for {target}: {done.stderr.strip()[-1000:]} Try another by the "
            "environment variable CC, or write a source-code FMU by platforms=()."
        )


def _compiler(target: str) -> list[str]:
    native = target == _HERE.get((platform.system(), platform.machine()))
    if native:
        given = shlex.split(os.environ.get("CC", ""))
        if given:
            return given
        for name in ("cc", "gcc", "clang"):
            if shutil.which(name):
                return [name]
    # zig turns traps for undefined behaviour on, which need a library of its own.
    more = ["-target", TARGETS[target].zig, "-fno-sanitize=undefined"]
    if importlib.util.find_spec("ziglang") is not None:
        return [sys.executable, "-m", "ziglang", "cc", *more]
    if shutil.which("zig"):
        return ["zig", "cc", *more]
    cure = "Install one, name it by the variable CC, or" if native else "Only zig builds for other platforms:"
    raise InputError(
        f"No C compiler for {target} is here. {cure} install zig by `pip install ziglang`. A source-code FMU, which "
        "some tools compile themselves, needs none: platforms=()."
    )
