"""A folder that one call alone holds, among the threads of a process and among processes."""

import contextlib
import errno
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from twin._checks import InputError

_TRIES, _PAUSE = 10, 0.2
"""A process that was just killed lets its claim go a moment later [-, s]."""
_HELD: dict[tuple[int, int, int], object] = {}
"""Folders that calls of this process hold: process, device and number of the folder."""


@contextlib.contextmanager
def held(folder: Path, file: Path) -> Iterator[None]:
    """Hold a folder; file systems that know no locks keep threads apart, but not processes.

    Args:
        folder: the folder, which is there.
        file: the file in it that is locked.

    Raises:
        InputError: another process holds it, or another thread of this one.
        OSError: the file cannot be made.
    """
    with _held_here(folder), open(file, "ab") as lock:
        tries = 1
        while _held_elsewhere(lock):
            if tries == _TRIES:
                raise _taken(folder, "another process")
            tries += 1
            time.sleep(_PAUSE)
        yield


@contextlib.contextmanager
def _held_here(folder: Path) -> Iterator[None]:
    # A lock of the process does not keep its own threads apart, and goes when any of them closes the file.
    about, me = os.stat(folder), object()
    place = (os.getpid(), about.st_dev, about.st_ino)  # a fork does not hold what its parent did
    if _HELD.setdefault(place, me) is not me:
        raise _taken(folder, "another thread of this program")
    try:
        yield
    finally:
        del _HELD[place]


def _taken(folder: Path, who: str) -> InputError:
    return InputError(
        f"The study in {folder} is being computed by {who}. Wait for it, or give another folder as store; "
        "twin.study.read_study reads what is there."
    )


def _held_elsewhere(lock: IO[bytes]) -> bool:
    try:
        _lock(lock)
    except OSError as error:
        return error.errno in (errno.EACCES, errno.EAGAIN)  # anything else: a file system without locks
    return False


def _lock(lock: IO[bytes]) -> None:
    if sys.platform == "win32":
        import msvcrt

        lock.seek(0)
        msvcrt.locking(lock.fileno(), msvcrt.LK_NBLCK, 1)
    else:
        import fcntl

        # A lock of the process, not of the file: children that outlive a killed process do not keep it.
        fcntl.lockf(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
