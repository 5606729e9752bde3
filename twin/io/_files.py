"""Checks shared by the readers before a file is opened."""

import os
from pathlib import Path

from twin._checks import InputError


def existing_file(path: str | os.PathLike[str], what: str) -> Path:
    """The path of a file that exists and is not empty.

    Args:
        path: where the file lies.
        what: what it should hold, for the message.

    Raises:
        InputError: if it does not exist, is a folder, a pipe or a device, or is empty.
    """
    file = Path(path)
    if "\0" in str(file):
        raise InputError(f"{what} {str(file)!r} has a zero byte in its name. Correct the path.")
    if not file.exists():
        raise InputError(f"{what} {str(file)!r} does not exist. Check the path and the working folder.")
    if not file.is_dir() and not file.is_file():
        raise InputError(f"{what} {str(file)!r} is a pipe or device, but a file is expected. Copy it to a file first.")
    if not file.is_file():
        raise InputError(f"{what} {str(file)!r} is a folder, but a file is expected. Give the path of one file.")
    if file.stat().st_size == 0:
        raise InputError(f"{what} {str(file)!r} is empty. Copy or export it again.")
    return file
