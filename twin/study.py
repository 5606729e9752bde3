"""Reading a study from its folder, also while it runs."""

from collections.abc import ItemsView, Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from twin._batch_plan import chunk_count, second_width
from twin._checks import InputError
from twin.batch_result import DONE, NOT_FINITE, STATUS, WAITING, BatchResult, blank, was_computed
from twin.store import Store, StoredChunk


class StudyStatus(NamedTuple):
    """How far a study is."""

    folder: Path
    """Its folder."""
    function: str
    """Name of its function."""
    counts: dict[str, int]
    """Samples by what became of them, see `twin.batch_result.STATUS`."""
    chunks: tuple[int, int]
    """Chunks of the first try that are there, and how many they are in all."""
    second_try: tuple[int, int]
    """The same of the second try, of samples whose outputs were not finite; it begins after the first."""
    damaged: int
    """Chunks that do not agree with their checksum; they are computed again when the study goes on."""
    seconds: float
    """Computing time of the samples that are there [s]."""
    versions: dict[str, str]
    """Versions of what computed it."""

    @property
    def complete(self) -> bool:
        """Whether nothing is left to compute."""
        return self.chunks[0] == self.chunks[1] and self.second_try[0] == self.second_try[1]

    def __str__(self) -> str:
        total, waiting = sum(self.counts.values()), self.counts[STATUS[WAITING]]
        lines = [
            f"Study of {self.function} in {self.folder}",
            f"{total - waiting:,} of {total:,} samples ({self.chunks[0]:,} of {self.chunks[1]:,} chunks), "
            f"{self.seconds:.3g} s of computing",
        ]
        if self.second_try[1]:
            lines.append(f"  second try: {self.second_try[0]:,} of {self.second_try[1]:,} chunks")
        lines += [
            f"  {name.replace('_', ' ')}: {count:,}"
            for name, count in self.counts.items()
            if count and name not in (STATUS[WAITING], STATUS[DONE])
        ]
        if self.damaged:
            lines.append(f"  damaged chunks: {self.damaged}; they are computed again when the study goes on")
        lines.append("  " + ", ".join(f"{name} {version}" for name, version in self.versions.items()))
        lines.append("Complete." if self.complete else "The same call with the same store goes on.")
        return "\n".join(lines)


def read_study(folder: str | Path) -> BatchResult:
    """The results of a study that are there, also while it runs elsewhere.

    Args:
        folder: what was given as `store`.

    Returns:
        Results of all samples; those not computed yet are "waiting" and hold NaN. Outputs are read when asked for.

    Raises:
        InputError: no study there, or its manifest or its samples are damaged.
    """
    store = Store.open(folder)
    gathered = gathered_from(store, only=())
    return BatchResult(StoredOutputs(store), gathered.status, gathered.seconds, gathered.messages, store.samples())


def study_status(folder: str | Path) -> StudyStatus:
    """How far a study is; reads every chunk and checks it.

    Raises:
        InputError: no study there, or its manifest is damaged.
    """
    store = Store.open(folder)
    size = int(store.manifest["chunks"]["size"])
    first = chunk_count(store.count, size)
    # One look at the folder: a study that runs has more chunks at the next one.
    chunks = sorted(store.files().items())
    gathered = Gathered(store.count, only=())
    gathered.read(store, [file for number, file in chunks if number < first])
    tried = gathered.chunks
    again = int(np.count_nonzero(gathered.status == NOT_FINITE)) if store.manifest["retry"] else 0
    gathered.read(store, [file for number, file in chunks if number >= first])
    number = np.bincount(gathered.status, minlength=len(STATUS))
    return StudyStatus(
        store.folder,
        store.manifest["function"]["name"],
        dict(zip(STATUS, number.tolist(), strict=True)),
        (tried, first),
        (gathered.chunks - tried, chunk_count(again, second_width(size))),
        gathered.damaged,
        float(gathered.seconds.sum()),
        store.manifest["versions"],
    )


class Gathered:
    """Chunks put together."""

    def __init__(self, count: int, only: tuple[str, ...] | None = None) -> None:
        self.status = np.full(count, WAITING, dtype=np.int8)
        self.seconds = np.zeros(count)
        self.messages: dict[int, str] = {}
        self.outputs: dict[str, np.ndarray] = {}
        self.chunks = self.damaged = 0
        self._only = only
        self._shapes: dict[str, tuple[int, ...]] = {}

    def require_alike(self, content: StoredChunk) -> None:
        """Raise unless a chunk has the outputs of those before.

        Raises:
            InputError: other names or shapes.
        """
        shapes = {name: values.shape[1:] for name, values in content.values.items()}
        self._shapes = self._shapes or shapes
        if shapes and shapes != self._shapes:
            raise InputError(
                f"The function returns {self._shapes} for some samples and {shapes} for others (names and shapes). "
                "Return the same for each."
            )

    def read(self, store: Store, files: Iterable[Path]) -> None:
        """Add chunks of a store, those that are whole; the others are counted."""
        for file in files:
            content = store.read(file)
            if content is None:
                self.damaged += 1
            else:
                self.add(content)

    def add(self, content: StoredChunk) -> None:
        """Put the samples of a chunk in their places.

        Raises:
            InputError: outputs of other names or shapes than those of chunks before.
        """
        self.require_alike(content)
        numbers = content.numbers
        computed = was_computed(content.status)
        self.chunks += 1
        self.status[numbers] = content.status
        # A sample tried again took the time of both.
        self.seconds[numbers] += content.seconds
        for number in numbers.tolist():
            self.messages.pop(number, None)
        self.messages |= content.messages
        for name, values in content.values.items():
            if self._only is None or name in self._only:
                if name not in self.outputs:
                    self.outputs[name] = blank(len(self.status), values)
                output = self.outputs[name]
                # One sample may give 1 where another gives 1.5.
                kind = np.result_type(output, values)
                if kind != output.dtype:
                    output = output.astype(kind)
                    output[~was_computed(self.status)] = blank(1, output)[0]
                output[numbers[computed]] = values[computed]
                output[numbers[~computed]] = blank(1, output)[0]
                self.outputs[name] = output


class StoredOutputs(Mapping[str, np.ndarray]):
    """Outputs of a study by name, read from its chunks when asked for."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def __getitem__(self, name: str) -> np.ndarray:
        found = gathered_from(self._store, only=(name,)).outputs
        if name not in found:
            raise KeyError(name)
        return found[name]

    def __contains__(self, name: object) -> bool:
        return name in list(self)

    def items(self) -> ItemsView[str, np.ndarray]:
        """All outputs, read in one go."""
        return gathered_from(self._store).outputs.items()

    def __iter__(self) -> Iterator[str]:
        for file in self._store.files().values():
            content = self._store.read(file)
            if content is not None and content.values:
                return iter(content.values)
        return iter(())

    def __len__(self) -> int:
        return len(list(iter(self)))


def gathered_from(store: Store, only: tuple[str, ...] | None = None) -> Gathered:
    """All chunks of a store that are whole.

    Args:
        store: the store.
        only: names of the outputs wanted; None for all.
    """
    gathered = Gathered(store.count, only)
    gathered.read(store, [file for _, file in sorted(store.files().items())])
    return gathered
