"""A study on disk: a folder with a manifest, the samples and one checksummed file for each chunk.

Every file is written aside and renamed, so that what has its name is whole, whenever the computer stops. The name of a
chunk holds the digest of its content: a byte that flips later is found when it is read. Nothing is pickled.
"""

import hashlib
import io
import json
import os
import zipfile
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np

from twin._checks import InputError
from twin._tree_names import leaf_name

_FORMAT = 1
_MANIFEST, _SAMPLES, _ASIDE = "manifest.json", "samples.npz", ".partial"
_VALUE, _SAMPLE = "value ", "sample "  # no name of an array can then be one of NumPy's arguments


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

    @classmethod
    def begin(cls, folder: Path, manifest: dict[str, Any], samples: Any) -> "Store":
        """Make the folder of a new study.

        Raises:
            InputError: a folder that holds anything else.
            OSError: it cannot be written.
        """
        folder.mkdir(parents=True, exist_ok=True)
        # What a study leaves that was killed while it began.
        others = [f.name for f in folder.iterdir() if f.name not in (_SAMPLES, "chunks") and f.suffix != _ASIDE]
        if others:
            raise InputError(
                f"{folder} holds {sorted(others)[0]!r}, but no study. Give a new or an empty folder as store."
            )
        (folder / "chunks").mkdir(exist_ok=True)
        leaves = {
            _SAMPLE + (leaf_name(p) or "samples"): leaf for p, leaf in jax.tree_util.tree_leaves_with_path(samples)
        }
        _write(folder / _SAMPLES, _packed(leaves))
        manifest = {"format": _FORMAT, **manifest}
        _write(folder / _MANIFEST, json.dumps(manifest, indent=2).encode())
        return cls(folder, manifest)

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
            _ = manifest["function"]["name"], manifest["samples"]["count"], manifest["chunks"]["size"]
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
            arrays = _unpacked((self.folder / _SAMPLES).read_bytes())
            return {name.removeprefix(_SAMPLE): array for name, array in arrays.items()}
        except (OSError, ValueError, zipfile.BadZipFile) as error:
            raise InputError(f"The samples of {self.folder} cannot be read: {error}") from error

    def write(self, chunk: int, content: StoredChunk) -> None:
        """Write a chunk.

        Raises:
            OSError: no space left, or the folder is gone; what was written aside is removed.
        """
        about = {"messages": {str(number): text for number, text in content.messages.items()}}
        data = _packed(
            {
                "numbers": content.numbers,
                "status": content.status,
                "seconds": content.seconds,
                "about": np.frombuffer(json.dumps(about).encode(), dtype=np.uint8),
                **{f"{_VALUE}{name}": value for name, value in content.values.items()},
            }
        )
        _write(self.folder / "chunks" / f"{chunk:07d}-{_digest(data)}.npz", data)

    def files(self) -> dict[int, Path]:
        """Files of the chunks that are there, by number; whether they are whole is not looked at."""
        found = {}
        for file in sorted((self.folder / "chunks").glob("*-*.npz")):
            if file.name.split("-")[0].isdigit():
                found.setdefault(int(file.name.split("-")[0]), file)
        return found

    def read(self, file: Path) -> StoredChunk | None:
        """The content of a chunk's file; None where it is damaged."""
        try:
            data = file.read_bytes()
            if file.stem.split("-")[1] != _digest(data):
                return None
            arrays = _unpacked(data)
            about = json.loads(arrays["about"].tobytes())
            return StoredChunk(
                arrays["numbers"],
                arrays["status"],
                arrays["seconds"],
                {name.removeprefix(_VALUE): array for name, array in arrays.items() if name.startswith(_VALUE)},
                {int(number): text for number, text in about["messages"].items()},
            )
        except (OSError, ValueError, KeyError, zipfile.BadZipFile):
            return None

    def mend(self) -> tuple[set[int], list[int]]:
        """Remove what is damaged or was not finished.

        Returns:
            Numbers of the chunks that are whole, and of those that were damaged.
        """
        for left in [*self.folder.glob(f"*{_ASIDE}"), *(self.folder / "chunks").glob(f"*{_ASIDE}")]:
            left.unlink(missing_ok=True)
        whole, damaged = set(), []
        for number, file in self.files().items():
            if self.read(file) is None:
                file.unlink(missing_ok=True)
                damaged.append(number)
            else:
                whole.add(number)
        return whole, damaged


def _packed(arrays: dict[str, np.ndarray]) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)  # pyright: ignore[reportArgumentType]
    return buffer.getvalue()


def _unpacked(data: bytes) -> dict[str, np.ndarray]:
    with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
        return {name: arrays[name] for name in arrays.files}


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:32]


def _write(file: Path, data: bytes) -> None:
    aside = file.with_name(f"{file.name}.{os.getpid()}{_ASIDE}")
    try:
        with open(aside, "wb") as out:
            out.write(data)
            out.flush()
            os.fsync(out.fileno())
        os.replace(aside, file)
    except OSError:
        aside.unlink(missing_ok=True)
        raise
