"""Where the chunks of a batch are kept: in memory, or in a folder."""

import abc
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import numpy as np

from twin._checks import InputError
from twin._fingerprint import function_digest, function_name, samples_digest, versions
from twin._tree_names import leaf_name
from twin.batch_result import BatchResult
from twin.store import Store, StoredChunk
from twin.study import Gathered, gathered_from, read_study


class AbstractKept(abc.ABC):
    """Where chunks go, and what is there already."""

    width: int
    """Samples in a chunk."""

    @abc.abstractmethod
    def done(self) -> set[int]:
        """Numbers of the chunks that are there."""

    @abc.abstractmethod
    def write(self, chunk: int, content: StoredChunk) -> None:
        """Keep a chunk.

        Raises:
            OSError: it cannot be written.
        """

    @abc.abstractmethod
    def status(self) -> np.ndarray:
        """What became of each sample so far (samples,)."""

    @abc.abstractmethod
    def result(self) -> BatchResult:
        """All that is there."""

    @abc.abstractmethod
    def told(self) -> str:
        """What is left of the study where it stops, and how to go on."""


class InMemory(AbstractKept):
    """Chunks that are gone when the program ends."""

    def __init__(self, samples: Any, count: int, width: int) -> None:
        self.width = width
        self._samples = samples
        self._gathered = Gathered(count)

    def done(self) -> set[int]:
        """None."""
        return set()

    def write(self, chunk: int, content: StoredChunk) -> None:
        """Put it in its place."""
        self._gathered.add(content)

    def status(self) -> np.ndarray:
        """What became of each sample so far (samples,)."""
        return self._gathered.status

    def result(self) -> BatchResult:
        """All that is there."""
        leaves = {leaf_name(p) or "samples": leaf for p, leaf in jax.tree_util.tree_leaves_with_path(self._samples)}
        found = self._gathered
        return BatchResult(found.outputs, found.status, found.seconds, found.messages, leaves)

    def told(self) -> str:
        """Nothing is left."""
        return "Nothing of the study is kept: give a folder as store, and it goes on where it was."


class OnDisk(AbstractKept):
    """Chunks in the folder of a study."""

    def __init__(
        self, folder: Path, samples: Any, count: int, width: int, facts: dict[str, Any], *, asked: int | None
    ) -> None:
        """Begin a study, or find it.

        Args:
            folder: its folder.
            samples: the samples.
            count: how many.
            width: samples in a chunk, if the study is new.
            facts: what the study depends on, see `facts_of`.
            asked: samples in a chunk, if the caller asked for a number.

        Raises:
            InputError: another study is there.
            OSError: the folder cannot be written.
        """
        manifest = {**facts, "chunks": {"size": width}}
        if Store.is_in(folder):
            self._store = Store.open(folder)
            _require_same(self._store, facts, asked)
        else:
            self._store = Store.begin(folder, manifest, samples)
        self.width = int(self._store.manifest["chunks"]["size"])
        whole, damaged = self._store.mend()
        self._done = whole
        if damaged:
            warnings.warn(
                f"{len(damaged)} chunks of {folder} were damaged (the first is chunk {damaged[0]}) and are computed "
                "again. If it happens again, look at the disk.",
                stacklevel=4,
            )

    def done(self) -> set[int]:
        """Numbers of the chunks that are whole."""
        return self._done

    def write(self, chunk: int, content: StoredChunk) -> None:
        """Write a chunk."""
        self._store.write(chunk, content)

    def status(self) -> np.ndarray:
        """What became of each sample so far (samples,)."""
        return gathered_from(self._store, only=()).status

    def result(self) -> BatchResult:
        """All that is there; outputs are read when asked for."""
        return read_study(self._store.folder)

    def told(self) -> str:
        """Where the chunks are."""
        return f"{len(self._store.files())} chunks are kept in {self._store.folder}; the same call goes on from there."


def facts_of(
    fn: Callable[..., Any],
    retry: Callable[..., Any] | None,
    samples: Any,
    count: int,
    order: np.ndarray,
    seed: int | None,
    mode: str,
) -> dict[str, Any]:
    """What a study depends on, for its manifest."""
    return {
        "function": {"name": function_name(fn), "digest": function_digest(fn), "mode": mode},
        "retry": None if retry is None else {"name": function_name(retry), "digest": function_digest(retry)},
        "samples": {"count": count, "digest": samples_digest(samples)},
        "order": samples_digest(order),
        "seed": seed,
        "dtype": "float64",
        "versions": versions(),
    }


def _require_same(store: Store, facts: dict[str, Any], asked: int | None) -> None:
    """Raise unless the study in a folder is the one that is to go on."""
    changed = list(_changes(store.manifest, facts))
    size = store.manifest["chunks"]["size"]
    if asked not in (None, size):
        changed.append(f"chunk_size was {size} and is {asked} now")
    if changed:
        raise InputError(
            f"{store.folder} holds another study: {'; '.join(changed)}. "
            "Give another folder as store, or undo the change."
        )


def _changes(old: dict[str, Any], new: dict[str, Any]) -> list[str]:
    changes = []
    for key, what in (("function", "the function"), ("retry", "the function of the second try")):
        was, now = old.get(key) or {}, new[key] or {}
        if was.get("name") != now.get("name"):
            changes.append(f"{what} was {was.get('name', 'none')} and is {now.get('name', 'none')} now")
        elif was != now:
            changes.append(
                f"{what} {now['name']} was changed: its source, the values that it is closed over, or its mode"
            )
    if old["samples"] != new["samples"]:
        was, now = old["samples"]["count"], new["samples"]["count"]
        changes.append(
            f"there were {was:,} samples and are {now:,} now"
            if was != now
            else "the values of the samples were changed"
        )
    elif old.get("order") != new["order"]:
        changes.append("difficulty was changed")
    for key in ("seed", "dtype"):
        if old.get(key) != new[key]:
            changes.append(f"{key} was {old.get(key)} and is {new[key]} now")
    for name, version in new["versions"].items():
        if old.get("versions", {}).get(name) != version:
            changes.append(f"{name} was {old.get('versions', {}).get(name)} and is {version} now")
    return changes
