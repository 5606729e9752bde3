"""The folder of a run's results: never written over without being told."""

import argparse
import json
import os
from pathlib import Path

from twin._input_error import InputError

_MARK = ".drivetwin.json"


def add_out(parser: argparse.ArgumentParser, default: str) -> None:
    """Give a command `--out DIR`, `--force` and `--json`.

    Args:
        parser: its parser.
        default: folder where none is named.
    """
    parser.add_argument(
        "--out", type=Path, default=Path(default), metavar="DIR", help="folder for the results (%(default)s)"
    )
    parser.add_argument("--force", action="store_true", help="replace the results of an earlier run in that folder")
    add_json(parser)


def add_json(parser: argparse.ArgumentParser) -> None:
    """Give a command `--json`.

    Args:
        parser: its parser.
    """
    parser.add_argument(
        "--json", action="store_true", default=argparse.SUPPRESS, help="print the summary as JSON, for programs"
    )


def open_folder(folder: Path, *, force: bool) -> Path:
    """Make the folder ready for the results of one run.

    A run that did not end may go on in its folder. With `force`, only what an earlier run has written is removed.

    Args:
        folder: where the results go; made if missing.
        force: whether an earlier run's results may be replaced.

    Returns:
        The folder.

    Raises:
        InputError: a file in its place, results of an earlier run, or files that are no results of ours.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(f"--out {str(folder)!r} is a file, but a folder is needed. Name another.")
    mark = folder / _MARK
    earlier = _read(mark)
    goes_on = earlier is not None and not earlier["finished"]
    if folder.exists() and any(folder.iterdir()) and not goes_on and not force:
        what = "the results of an earlier run" if earlier else "files already"
        raise InputError(
            f"{str(folder)!r} holds {what}. Name another folder by --out, or add --force to replace the results of an "
            "earlier run; files of yours stay, unless they have the same name."
        )
    if earlier and force:
        for name in earlier["files"]:
            written = folder / name
            if written.resolve().is_relative_to(folder.resolve()):  # the mark can be edited by anyone
                written.unlink(missing_ok=True)
    folder.mkdir(parents=True, exist_ok=True)
    before = earlier.get("before", []) if earlier and goes_on else _files(folder)
    mark.write_text(json.dumps({"finished": False, "before": before, "files": []}), encoding="utf-8")
    return folder


def close_folder(folder: Path) -> list[str]:
    """Note that the run has ended, and what it has written.

    Args:
        folder: as `open_folder` made it ready.

    Returns:
        Names of the files written, relative to the folder.
    """
    mark = folder / _MARK
    before = set((_read(mark) or {}).get("before", ()))
    files = [name for name in _files(folder) if name not in before]
    temporary = mark.with_suffix(".tmp")
    temporary.write_text(json.dumps({"finished": True, "files": files}, indent=1), encoding="utf-8")
    os.replace(temporary, mark)
    return files


def _files(folder: Path) -> list[str]:
    found = (path for path in folder.rglob("*") if path.is_file() and path.name != _MARK)
    return sorted(str(path.relative_to(folder)) for path in found)


def _read(mark: Path) -> dict | None:
    try:
        held = json.loads(mark.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    sound = isinstance(held, dict) and isinstance(held.get("files"), list) and isinstance(held.get("finished"), bool)
    return held if sound and all(isinstance(name, str) for name in held["files"]) else None
