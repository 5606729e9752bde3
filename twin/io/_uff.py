"""Datasets of universal files, by pyuff."""

import os
import re
from pathlib import Path
from typing import Any

from twin._checks import InputError
from twin.io._files import existing_file


def read_sets(path: str | os.PathLike[str]) -> tuple[list[dict[str, Any]], Path]:
    """All datasets of a universal file, and its path.

    Args:
        path: the file.

    Raises:
        InputError: a file that does not exist, is empty, is none, or is cut short.
    """
    import pyuff  # a second to import

    file = existing_file(path, "Universal file")
    check_whole(file)
    try:
        sets = pyuff.UFF(str(file)).read_sets()
    except Exception as error:  # pyuff raises nearly anything on a damaged file
        raise InputError(
            f"Universal file {str(file)!r} cannot be read ({type(error).__name__}: {error}). Export it again as ASCII."
        ) from error
    sets = sets if isinstance(sets, list) else [sets]
    if not any(isinstance(one, dict) and one.get("type") for one in sets):
        raise InputError(f"Universal file {str(file)!r} holds no dataset that can be read. Check that it is one.")
    return [one for one in sets if isinstance(one, dict) and "type" in one], file


def check_whole(file: Path) -> None:
    """Refuse a universal file that was cut short.

    Args:
        file: the file.

    Raises:
        InputError: a file that ends within a dataset.
    """
    content = file.read_bytes()
    if not re.match(rb"\s*?    -1\s*[\r\n]", content):
        raise InputError(f"Universal file {str(file)!r} holds no dataset at its beginning. Check that it is one.")
    marks = len(re.findall(rb"    -1(?=[\r\n]| {74}|\Z)", content))
    binary = re.search(rb"[\r\n]    58b", content) is not None  # binary numbers may look like a mark
    if marks < 2 or (marks % 2 and not binary) or not content.rstrip(b" \r\n\0\x1a").endswith(b"-1"):
        raise InputError(
            f"Universal file {str(file)!r} ends within a dataset: it is cut short. Copy or export it again."
        )


def unit_factors(sets: list[dict[str, Any]]) -> tuple[float, float]:
    """What lengths and forces of the file are divided by for SI (dataset 164), 1 where it does not say.

    Args:
        sets: datasets.
    """
    for one in sets:
        if one["type"] == 164:
            return float(one["length"]), float(one["force"])
    return 1.0, 1.0
