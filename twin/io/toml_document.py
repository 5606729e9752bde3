"""A TOML file whose errors name the file, the line and the key."""

import difflib
import os
import re
import tomllib
from collections.abc import Collection, Iterable
from pathlib import Path
from typing import Any

from twin._checks import InputError
from twin.io._files import existing_file

_LARGEST = 4_000_000
_NAME = r"""(?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*')"""
Key = tuple[str | int, ...]


class TomlDocument:
    """What a TOML file holds, and where its keys stand."""

    def __init__(self, path: str | os.PathLike[str], what: str = "study file"):
        """Read a file.

        Args:
            path: the file.
            what: what it is, for messages.

        Raises:
            InputError: a file that does not exist, is empty, far too large, not UTF-8, or not TOML (with the line).
        """
        self.what = what
        self.file = existing_file(path, what)
        if self.file.stat().st_size > _LARGEST:
            raise InputError(
                f"{what} {str(self.file)!r} has over {_LARGEST // 1_000_000} MB: it is not one. Check the path."
            )
        try:
            self.text = self.file.read_bytes().decode("utf-8-sig").replace("\r\n", "\n")
        except UnicodeDecodeError as error:
            raise InputError(f"{what} {str(self.file)!r} is not UTF-8 text: {error}. Save it as UTF-8.") from error
        try:
            self.data: dict[str, Any] = tomllib.loads(self.text)
        except (tomllib.TOMLDecodeError, RecursionError) as error:
            found = re.search(r"at line (\d+)", str(error))
            number = min(int(found.group(1)), len(self.text.split("\n"))) if found else len(self.text.split("\n"))
            line = self.text.split("\n")[number - 1].strip()[:80]
            raise InputError(
                f"{what} {str(self.file)!r}, line {number}: {error}; the line is {line!r}. Text needs quotes, as in "
                'mass = "80 kg"; a key with dots is quoted as a whole, as in ["plant.mass"].'
            ) from error
        self._lines = _lines_of(self.text)

    @property
    def folder(self) -> Path:
        """Folder of the file, from which paths in it count."""
        return self.file.parent

    def line(self, key: Iterable[str | int]) -> int | None:
        """Line on which a key stands, or the nearest table around it that can be found; None at the very top.

        Args:
            key: names of tables and numbers of entries from the top.
        """
        path = tuple(key)
        while path and path not in self._lines:
            path = path[:-1]
        return self._lines.get(path)

    def error(self, key: Iterable[str | int], message: str) -> InputError:
        """An error about a key.

        Args:
            key: names of tables and numbers of entries from the top.
            message: what is wrong and what to do.
        """
        path = tuple(key)
        line = self.line(path)
        where = f", line {line}" if line else ""
        named = f", key {dotted(path)}" if path else ""
        return InputError(f"{self.what} {str(self.file)!r}{where}{named}: {message}")

    def table(self, key: Iterable[str | int], *, required: bool = False) -> dict[str, Any]:
        """A table; empty if it is not there.

        Args:
            key: names of tables from the top.
            required: whether it must be there.

        Raises:
            InputError: no table under that key, or none where one is required.
        """
        path, node = tuple(key), self.data
        for i, name in enumerate(path):
            if isinstance(node, dict) and name not in node:
                if required:
                    raise self.error(path[:i], f"the table [{dotted(path)}] is missing. Add it.")
                return {}
            node = node[name]  # pyright: ignore[reportArgumentType]
            if not isinstance(node, dict):
                raise self.error(path[: i + 1], f"must be a table, but is {node!r}. Write [{dotted(path[: i + 1])}].")
        return node

    def check_keys(self, key: Iterable[str | int], known: Collection[str]) -> None:
        """Refuse keys of a table that mean nothing.

        Args:
            key: names of tables from the top.
            known: keys that may be there.

        Raises:
            InputError: naming the key, the nearest known one, and all.
        """
        path = tuple(key)
        for name in self.table(path):
            if name not in known:
                raise self.error((*path, name), unknown("key", name, known))


def unknown(what: str, name: str, known: Collection[str]) -> str:
    """A sentence about a name that is not known.

    Args:
        what: what it names.
        name: as written.
        known: names that exist.
    """
    near = difflib.get_close_matches(name, list(known), n=1, cutoff=0.6)
    hint = f" Did you mean {near[0]!r}?" if near else ""
    return f"the {what} {name!r} is not known; known are {', '.join(sorted(known)) or 'none'}.{hint}"


def dotted(key: Iterable[str | int]) -> str:
    """A key as TOML writes it.

    Args:
        key: names of tables and numbers of entries from the top.
    """
    return ".".join(str(k) if re.fullmatch(r"[A-Za-z0-9_-]+", str(k)) else f'"{k}"' for k in key)


def _lines_of(text: str) -> dict[Key, int]:
    """Line of each table and of each key that stands at the beginning of a line."""
    found: dict[Key, int] = {}
    table: Key = ()
    counts: dict[Key, int] = {}
    for number, line in enumerate(text.split("\n"), start=1):
        header = re.match(r"\s*(\[\[?)\s*(.+?)\s*\]\]?\s*(#.*)?$", line)
        entry = re.match(
            r"""\s*((?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*')(?:\s*\.\s*(?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*'))*)\s*=""", line
        )
        if header and not entry and (path := _parsed(header.group(2))):
            if header.group(1) == "[[":
                counts[path] = counts.get(path, -1) + 1
                path = (*path, counts[path])
            else:
                for length in range(len(path), 0, -1):  # tables below an entry of a list of tables
                    if path[:length] in counts:
                        path = (*path[:length], counts[path[:length]], *path[length:])
                        break
            table = path
            found.setdefault(table, number)
        elif entry and (path := _parsed(entry.group(1))):
            for length in range(1, len(path) + 1):
                found.setdefault((*table, *path[:length]), number)
    return found


def _parsed(key: str) -> Key:
    """The names in a dotted key."""
    try:
        node: Any = tomllib.loads(f"{key} = 0")
    except tomllib.TOMLDecodeError:
        return ()
    names = []
    while isinstance(node, dict):
        (name, node), *_ = node.items()
        names.append(name)
    return tuple(names)
