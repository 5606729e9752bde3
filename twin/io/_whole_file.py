"""Files that are written whole or not at all."""

import contextlib
import os
import uuid
from collections.abc import Iterator
from pathlib import Path

from twin._checks import InputError


@contextlib.contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary file beside the one wanted, which takes its place at the end.

    No reader and no crash ever meets half a file; after an error the old one is as it was.

    Args:
        path: the file wanted; one that exists is replaced.

    Raises:
        InputError: if its folder does not exist, or it is a folder itself.
    """
    target = Path(path).resolve()
    if not target.parent.is_dir():
        raise InputError(f"the folder of {str(path)!r} does not exist. Create it first, or correct the path.")
    if target.is_dir():
        raise InputError(f"{str(path)!r} is a folder, but a file is to be written. Add a file name.")
    # The ending stays, as some libraries go by it.
    temporary = target.with_name(f".{uuid.uuid4().hex}.{target.name}")
    try:
        yield temporary
        with temporary.open("rb+") as stream:
            os.fsync(stream.fileno())
        os.replace(temporary, target)
    finally:
        temporary.unlink(missing_ok=True)
