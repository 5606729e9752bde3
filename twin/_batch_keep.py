"""Where the chunks of a batch are kept: in memory, or in a folder."""

import abc
import contextlib
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from twin._batch_facts import require_same
from twin._batch_plan import Plan
from twin._checks import InputError
from twin._tree_names import named_leaves
from twin.batch_result import BatchResult
from twin.store import Store, StoredChunk, claim
from twin.study import Gathered, read_study


class AbstractKept(abc.ABC):
    """Where chunks go, and what is there already."""

    width: int
    """Samples in a chunk."""

    @abc.abstractmethod
    def done(self, plan: Plan, offset: int) -> set[int]:
        """Numbers of the chunks of a plan that are there, in the plan.

        Args:
            plan: the plan.
            offset: number of its first chunk.
        """

    @abc.abstractmethod
    def write(self, chunk: int, content: StoredChunk) -> None:
        """Keep a chunk.

        Raises:
            InputError: its outputs have other names or shapes than those of chunks before.
            StoreFailed: it cannot be written.
        """

    @abc.abstractmethod
    def status(self, chunks: int) -> np.ndarray:
        """What became of each sample in the first so many chunks (samples,)."""

    @abc.abstractmethod
    def result(self) -> BatchResult:
        """All that is there."""

    @abc.abstractmethod
    def close(self) -> None:
        """Let go what it holds."""

    @abc.abstractmethod
    def told(self) -> str:
        """What is left of the study where it stops, and how to go on."""


class InMemory(AbstractKept):
    """Chunks that are gone when the program ends."""

    def __init__(self, samples: Any, count: int, width: int) -> None:
        self.width = width
        self._samples = samples
        self._gathered = Gathered(count)

    def done(self, plan: Plan, offset: int) -> set[int]:
        """None."""
        return set()

    def write(self, chunk: int, content: StoredChunk) -> None:
        """Put it in its place."""
        self._gathered.add(content)

    def status(self, chunks: int) -> np.ndarray:
        """What became of each sample so far (samples,): the first chunks come first."""
        return self._gathered.status

    def result(self) -> BatchResult:
        """All that is there."""
        found, samples = self._gathered, named_leaves(self._samples, "samples")
        return BatchResult(found.outputs, found.status, found.seconds, found.messages, samples)

    def told(self) -> str:
        """Nothing is left."""
        return "Nothing of the study is kept: give a folder as store, and it goes on where it was."

    def close(self) -> None:
        """It holds nothing."""


class OnDisk(AbstractKept):
    """Chunks in the folder of a study, which it holds until it is closed."""

    def __init__(self, folder: Path, samples: Any, count: int, width: int, facts: dict[str, Any]) -> None:
        """Begin a study, or find it.

        Args:
            folder: its folder.
            samples: the samples.
            count: how many.
            width: samples in a chunk, if the study is new.
            facts: what the study depends on, see `facts_of`.

        Raises:
            InputError: another study is there, or another process computes it.
            StoreFailed: the folder cannot be written.
        """
        self._outlines: dict[int, StoredChunk] = {}
        self._gathered = Gathered(count, only=())
        with _disk_explained(), contextlib.ExitStack() as stack:
            stack.enter_context(claim(folder))
            warned = self._begin(folder, samples, {**facts, "chunks": {"size": width}})
            damaged = [number for number, content in self._store.mended() if not self._is_whole(number, content)]
            self._claim = stack.pop_all()
        self.width = int(self._store.manifest["chunks"]["size"])
        if damaged:
            warned.append(
                f"{len(damaged)} chunks were damaged or of another study (the first is chunk {damaged[0]}) and are "
                "computed again"
            )
        for text in warned:
            warnings.warn(f"{folder}: {text}. If it happens again, look at the disk.", stacklevel=4)

    def _begin(self, folder: Path, samples: Any, manifest: dict[str, Any]) -> list[str]:
        if not Store.is_in(folder):
            self._store = Store.begin(folder, manifest, samples)
            return []
        self._store = Store.open(folder)
        require_same(self._store, manifest)
        try:
            self._store.samples()
        except InputError:
            self._store.write_samples(samples)
            return ["the samples were damaged and were written again"]
        return []

    def _is_whole(self, number: int, content: StoredChunk | None) -> bool:
        if content is not None:
            self._note(number, content)
        return content is not None

    def _note(self, number: int, content: StoredChunk) -> None:
        # Without its values: they stay on the disk.
        outline = content._replace(values={name: values[:0] for name, values in content.values.items()})
        self._gathered.add(outline)
        self._outlines[number] = outline

    def done(self, plan: Plan, offset: int) -> set[int]:
        """Numbers of the chunks that are there; those of other samples are removed."""
        found = set()
        for chunk in range(plan.chunks):
            there = self._outlines.get(offset + chunk)
            if there is not None and np.array_equal(there.numbers, plan.members(chunk)):
                found.add(chunk)
            elif there is not None:
                with _disk_explained():
                    self._store.remove(offset + chunk)
                del self._outlines[offset + chunk]
        return found

    def write(self, chunk: int, content: StoredChunk) -> None:
        """Write a chunk."""
        self._gathered.require_alike(content)
        with _disk_explained():
            self._store.write(chunk, content)
        self._note(chunk, content)

    def status(self, chunks: int) -> np.ndarray:
        """What became of each sample in the first so many chunks (samples,)."""
        gathered = Gathered(self._store.count, only=())
        for number, outline in self._outlines.items():
            if number < chunks:
                gathered.add(outline)
        return gathered.status

    def result(self) -> BatchResult:
        """All that is there; outputs are read when asked for."""
        return read_study(self._store.folder)

    def told(self) -> str:
        """Where the chunks are."""
        return f"{len(self._outlines)} chunks are kept in {self._store.folder}; the same call goes on from there."

    def close(self) -> None:
        """Let the folder go."""
        self._claim.close()


class StoreFailed(RuntimeError):
    """A store that cannot be read or written."""


@contextlib.contextmanager
def _disk_explained() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise StoreFailed(str(error)) from error
