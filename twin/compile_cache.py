"""Compiled programs kept on disk, so that the next process takes them from there instead of compiling them again."""

import contextlib
import hashlib
import os
import platform
import tempfile
from pathlib import Path
from typing import Any

import jax
import jaxlib.version

from twin._checks import positive
from twin._user_cache import user_cache

_SWITCH = "DRIVETWIN_COMPILE_CACHE"
_OFF = ("off", "0", "no", "false")
_LEAST_TIME = "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"
# Programs that compile faster [s] are as quickly compiled again as read.
_WORTH_KEEPING = 0.05
_CPUINFO = Path("/proc/cpuinfo")
_CPU_FACTS = ("model name", "flags", "Features", "CPU implementer", "CPU part")


def use_compile_cache(folder: str | Path | None = None, *, size_limit: int = 500_000_000) -> str | None:
    """Keep compiled programs on disk and take them from there, in this process, from now on.

    For programs, notebooks and workers, never for packages: it changes JAX's configuration. Call it at the start. It
    saves XLA's compilation; JAX still traces every program.

    The programs lie in a sub-folder for these versions of JAX and this processor, so computers with a common home may
    share the folder. Several processes may use it at once. Where it cannot be written there is no cache, and no error;
    a damaged entry costs a warning of JAX and its compilation.

    The user's own settings stay as they are: a folder that JAX has already, JAX_ENABLE_COMPILATION_CACHE and
    JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS. The environment variable DRIVETWIN_COMPILE_CACHE=off switches this
    function off. Entries are code that will be run: use no folder into which others may write.

    Args:
        folder: where the programs are kept; `compiled` in this package's part of the user's cache if not given.
        size_limit: size of the folder [bytes]. What is beyond is dropped by this call, the longest unused first.

    Returns:
        The folder that JAX uses now, or None if there is no cache.

    Raises:
        InputError: size_limit is not positive.

    Source: https://docs.jax.dev/en/latest/persistent_compilation_cache.html
    """
    positive("size_limit", size_limit, "bytes")
    if os.environ.get(_SWITCH, "").strip().lower() in _OFF or not _setting("jax_enable_compilation_cache"):
        return None
    chosen = _setting("jax_compilation_cache_dir")
    if chosen:
        return chosen
    root = (user_cache() / "compiled" if folder is None else Path(folder)).absolute()
    programs = root / f"jax-{jax.__version__}-{jaxlib.version.__version__}-{_processor()}"
    if not _can_be_written(programs):
        return None
    # Not left to jax_compilation_cache_max_size: it needs one more package, locks the folder for every read, knows
    # nothing of other versions' folders, and a process killed while it writes may keep all others from writing.
    _trim(root, size_limit)
    if _LEAST_TIME not in os.environ:
        jax.config.update("jax_persistent_cache_min_compile_time_secs", _WORTH_KEEPING)
    jax.config.update("jax_compilation_cache_dir", str(programs))
    return str(programs)


def _setting(name: str) -> Any:
    return getattr(jax.config, name)


def _processor() -> str:
    """Short name of what XLA compiles for; machine code for one processor may crash on another."""
    facts = [platform.system(), platform.machine()]
    try:
        first = _CPUINFO.read_text(encoding="utf-8").partition("\n\n")[0]
        facts += [line for line in first.splitlines() if line.startswith(_CPU_FACTS)]
    except OSError:  # not Linux
        facts.append(platform.processor())
    return hashlib.sha256("\n".join(facts).encode()).hexdigest()[:12]


def _can_be_written(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _trim(root: Path, limit: int) -> None:
    entries = []
    for file in root.glob("jax-*/*-cache"):
        # Another process may have dropped it meanwhile.
        with contextlib.suppress(OSError):
            seen = file.stat()
            entries.append((max(seen.st_atime, seen.st_mtime), seen.st_size, file))
    total = 0
    for _, size, file in sorted(entries, reverse=True):
        total += size
        # JAX never replaces an entry, not even one left empty when the disk was full.
        if size == 0 or total > limit:
            with contextlib.suppress(OSError):
                file.unlink()
