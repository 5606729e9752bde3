"""A study on disk: a folder with a manifest, the samples and one checksummed file for each chunk.

Every file is written aside and renamed, so that what has its name is whole, whenever the computer stops. The name of a
chunk holds the digest of its content: a byte that flips later is found when it is read. It also holds the digest of the
manifest: a chunk of another study is never read as one of this. Nothing is pickled.
"""

import contextlib
import hashlib
import io
import json
import os
import uuid
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from twin._checks import InputError
from twin._store_lock import held
from twin._tree_names import named_leaves

_FORMAT = 2
_MANIFEST, _SAMPLES, _CHUNKS, _LOCK, _ASIDE = "manifest.json", "samples.npz", "chunks", "lock", ".partial"
_VALUE = "value "
_ABOUT_SAMPLES = ("numbers", "status", "seconds")
_DAMAGES = (OSError, ValueError, KeyError, TypeError, EOFError, NotImplementedError, zipfile.BadZipFile, zlib.error)
"""What reading a damaged file raises."""


class StoredChunk(NamedTuple):
    """The content of a chunk's file."""

    numbers: np.ndarray
    """Numbers of its samples (rows,)."""
    status: np.ndarray
    """What became of each (rows,); see `twin.batch_result.STATUS`."""
    seconds: np.ndarray
    """Wall time of each [s] (rows,)."""
    values: dict[str, np.ndarray]
    """Outputs by name (rows, ...); empty where no sample of the chunk could be computed."""
    messages: dict[int, str]
    """What the samples that raised said, by their number."""


class Store:
    """The folder of one study."""

    def __init__(self, folder: Path, manifest: dict[str, Any]) -> None:
        self.folder = folder
        self.manifest = manifest
        self._study = _checksum(manifest)

    @classmethod
    def begin(cls, folder: Path, manifest: dict[str, Any], samples: Any) -> "Store":
        """Write manifest and samples of a new study into a claimed folder.

        Raises:
            InputError: chunks of a study whose manifest is gone are there.
            OSError: it cannot be written.
        """
        (folder / _CHUNKS).mkdir(exist_ok=True)
        store = cls(folder, {"format": _FORMAT, **manifest})
        if store.files():
            raise InputError(
                f"{folder} holds {len(store.files())} chunks of a study, but no {_MANIFEST} that tells of which. Give "
                "a new or an empty folder as store, or put the manifest back."
            )
        store.write_samples(samples)
        text = json.dumps({**store.manifest, "checksum": _checksum(store.manifest)}, indent=2)
        _write(folder / _MANIFEST, text.encode())
        return store

    @classmethod
    def open(cls, folder: str | Path) -> "Store":
        """The study in a folder.

        Raises:
            InputError: there is none, or its manifest cannot be read.
        """
        folder = Path(folder)
        file = folder / _MANIFEST
        if not file.is_file():
            raise InputError(f"{folder} holds no study: there is no {_MANIFEST}. Give the folder that was the store.")
        try:
            manifest = json.loads(file.read_text(encoding="utf-8"))
            if manifest["format"] != _FORMAT:
                raise InputError(
                    f"{file} has the format {manifest['format']}, but this version reads {_FORMAT}. "
                    "Read it with the version that wrote it."
                )
            if manifest.pop("checksum") != _checksum(manifest):
                raise ValueError("its checksum is wrong")
        except (ValueError, KeyError, TypeError) as error:
            if isinstance(error, InputError):
                raise
            raise InputError(
                f"{file} is damaged ({error!r}). Take a new folder; the chunks alone are not enough."
            ) from error
        return cls(folder, manifest)

    @staticmethod
    def is_in(folder: Path) -> bool:
        """Whether a folder holds a study."""
        return (folder / _MANIFEST).is_file()

    @property
    def count(self) -> int:
        """Number of samples."""
        return int(self.manifest["samples"]["count"])

    def samples(self) -> dict[str, np.ndarray]:
        """The samples by name.

        Raises:
            InputError: the file is damaged.
        """
        try:
            arrays, about = _unpacked((self.folder / _SAMPLES).read_bytes())
            if about["digest"] != _digest(b"".join(array.tobytes() for array in arrays.values())):
                raise ValueError("their checksum is wrong")
        except _DAMAGES as error:
            raise InputError(
                f"The samples of {self.folder} cannot be read ({error}). The call that computes the study writes them "
                "again."
            ) from error
        return arrays

    def write_samples(self, samples: Any) -> None:
        """Write the samples.

        Raises:
            OSError: no space left, or the folder is gone.
        """
        leaves = named_leaves(samples, "samples")
        digest = _digest(b"".join(leaf.tobytes() for leaf in leaves.values()))
        _write(self.folder / _SAMPLES, _packed(leaves, digest=digest))

    def write(self, chunk: int, content: StoredChunk) -> None:
        """Write a chunk.

        Raises:
            OSError: no space left, or the folder is gone; what was written aside is removed.
        """
        values = {f"{_VALUE}{name}": value for name, value in content.values.items()}
        messages = {str(number): text for number, text in content.messages.items()}
        arrays = {**{name: getattr(content, name) for name in _ABOUT_SAMPLES}, **values}
        data = _packed(arrays, study=self._study, messages=messages)
        _write(self.folder / _CHUNKS / f"{chunk:07d}-{_digest(data)}.npz", data)

    def remove(self, chunk: int) -> None:
        """Remove a chunk, if it is there."""
        file = self.files().get(chunk)
        if file is not None:
            file.unlink(missing_ok=True)

    def files(self) -> dict[int, Path]:
        """Files of the chunks that are there, by number; whether they are whole is not looked at."""
        found = {}
        for file in sorted((self.folder / _CHUNKS).glob("*-*.npz")):
            if file.name.split("-")[0].isdigit():
                found.setdefault(int(file.name.split("-")[0]), file)
        return found

    def read(self, file: Path) -> StoredChunk | None:
        """The content of a chunk's file; None where it is damaged or gone, or of another study.

        Raises:
            OSError: it cannot be read, which does not say that it is damaged.
        """
        try:
            data = file.read_bytes()
            if file.stem.split("-")[1] != _digest(data):
                return None
            arrays, about = _unpacked(data)
            if about["study"] != self._study:
                return None
            values = {n.removeprefix(_VALUE): array for n, array in arrays.items() if n.startswith(_VALUE)}
            messages = {int(number): text for number, text in about["messages"].items()}
            about_samples = {name: arrays[name] for name in _ABOUT_SAMPLES}
            return StoredChunk(**about_samples, values=values, messages=messages)
        except (FileNotFoundError, *_DAMAGES[1:]):
            return None

    def mended(self) -> Iterator[tuple[int, StoredChunk | None]]:
        """Number and content of each chunk; None in place of one that was damaged. Removes that, and what was not
        finished; so it is for those alone who hold the claim.
        """
        for left in [*self.folder.glob(f"*{_ASIDE}"), *(self.folder / _CHUNKS).glob(f"*{_ASIDE}")]:
            left.unlink(missing_ok=True)
        (self.folder / _CHUNKS).mkdir(exist_ok=True)
        for number, file in self.files().items():
            content = self.read(file)
            if content is None:
                file.unlink(missing_ok=True)
            yield number, content


@contextlib.contextmanager
def claim(folder: Path) -> Iterator[None]:
    """Hold a folder for this call, and make it if it is not there.

    Raises:
        InputError: a file is in the place of the folder, or the folder holds anything but a study, or another process
            or another thread of this one computes it.
        OSError: it cannot be made.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder} is a file. Give a new or an empty folder as store.")
    folder.mkdir(parents=True, exist_ok=True)
    _require_own(folder)
    with held(folder, folder / _LOCK):
        yield


def _require_own(folder: Path) -> None:
    # A study that was killed while it began leaves all but the manifest.
    own = (_MANIFEST, _SAMPLES, _CHUNKS, _LOCK)
    others = sorted(f.name for f in folder.iterdir() if f.name not in own and f.suffix != _ASIDE)
    if others and not Store.is_in(folder):
        raise InputError(f"{folder} holds {others[0]!r}, but no study. Give a new or an empty folder as store.")


def _checksum(manifest: dict[str, Any]) -> str:
    return _digest(json.dumps(manifest, sort_keys=True).encode())


def _packed(arrays: Mapping[str, np.ndarray], **about: Any) -> bytes:
    """Arrays of any name, numbered in the archive, and facts about them."""
    text = np.frombuffer(json.dumps({**about, "names": list(arrays)}).encode(), dtype=np.uint8)
    buffer = io.BytesIO()
    numbered = {str(number): array for number, array in enumerate(arrays.values())}
    np.savez(buffer, about=text, **numbered)  # pyright: ignore[reportArgumentType]
    return buffer.getvalue()


def _unpacked(data: bytes) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
        about = json.loads(arrays["about"].tobytes())
        return {name: arrays[str(number)] for number, name in enumerate(about["names"])}, about


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:32]


def _write(file: Path, data: bytes) -> None:
    aside = file.with_name(f"{file.name}.{uuid.uuid4().hex}{_ASIDE}")
    try:
        with open(aside, "wb") as out:
            out.write(data)
            out.flush()
            os.fsync(out.fileno())
        os.replace(aside, file)
    except OSError:
        with contextlib.suppress(OSError):
            aside.unlink(missing_ok=True)
        raise
