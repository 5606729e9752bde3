"""A walk through an HDF5 file that stays within it: nothing outside is opened, nothing is read beyond the limit."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from twin._checks import InputError
from twin.io.formats import _hdf5_probe
from twin.io.formats._shared import check_room

_DEEPEST, _MOST_OBJECTS = 24, 100_000
# Filters that are built in: deflate, shuffle, Fletcher-32, szip, n-bit, scale-offset, LZF. Others would load code.
_FILTERS = frozenset({1, 2, 3, 4, 5, 6, 32000})


# A first reading may take so many seconds, and one more for so many bytes of the file.
_PATIENCE, _RATE = 10.0, 20e6


def _probe(file: Path, limit: int) -> None:
    """Have the file read by a process of its own first.

    Raises:
        InputError: if that crashes, comes to no end or needs more memory than may be read.
    """
    if not sys.executable:  # embedded in another program
        return
    script = Path(_hdf5_probe.__file__)
    surroundings = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "OPENBLAS_NUM_THREADS": "1"}
    damaged = f"{str(file)!r} is damaged: the HDF5 library"
    try:
        done = subprocess.run(
            [sys.executable, "-P", str(script), str(file), str(limit)],
            env=surroundings, stdin=subprocess.DEVNULL, capture_output=True, check=False,
            timeout=_PATIENCE + file.stat().st_size / _RATE,
        )  # fmt: skip
    except subprocess.TimeoutExpired as error:
        raise InputError(f"{damaged} does not come to an end with it. Export it again.") from error
    if done.returncode == _hdf5_probe.TOO_LARGE:
        raise InputError(f"{damaged} needs more memory for it than may be read. Export it again.")
    if done.returncode < 0:
        raise InputError(f"{damaged} breaks down over it (signal {-done.returncode}). Export it again.")


class SafeHdf5:
    """An open HDF5 file whose links, storage and sizes are looked at before they are followed."""

    def __init__(self, file: Path, limit: int):
        import h5py  # a third of a second to import

        self.path = file
        self.limit = limit
        self.used = 0
        self.left_out: list[str] = []
        self._visited: set[int] = set()
        _probe(file, limit)
        try:
            self.file = h5py.File(file, "r", locking=False)
        except OSError as error:
            raise InputError(
                f"{str(file)!r} cannot be opened as HDF5 ({str(error)[:160]}): it is truncated or damaged. Copy or "
                "export it again."
            ) from error

    def __enter__(self) -> "SafeHdf5":
        return self

    def __exit__(self, *_: object) -> None:
        self.file.close()

    def items(self, group: Any) -> Iterator[tuple[str, Any]]:
        """Members of a group by name, without soft and external links.

        Args:
            group: an h5py group.
        """
        import h5py

        for name in group:
            if len(self._visited) > _MOST_OBJECTS:
                raise InputError(f"{str(self.path)!r} has more than {_MOST_OBJECTS} objects. Check that it is sound.")
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                self.left_out.append(f"{name!r} is a link to somewhere else and is left out.")
                continue
            member = group[name]
            address = h5py.h5o.get_info(member.id).addr  # pyright: ignore[reportAttributeAccessIssue]
            if address in self._visited and isinstance(member, h5py.Group):
                continue
            self._visited.add(address)
            yield name, member

    def datasets(self, group: Any = None, depth: int = 1) -> Iterator[Any]:
        """All datasets at and beneath a group.

        Args:
            group: an h5py group; None for the file.
            depth: how deep this group lies.
        """
        import h5py

        if depth > _DEEPEST:
            raise InputError(f"{str(self.path)!r} nests groups deeper than {_DEEPEST}. Check that it is sound.")
        for _, member in self.items(self.file if group is None else group):
            if isinstance(member, h5py.Group):
                yield from self.datasets(member, depth + 1)
            elif isinstance(member, h5py.Dataset):
                yield member

    def numbers(self, dataset: Any) -> np.ndarray | None:
        """The numbers of a dataset; None where it holds none, or none that may be read.

        Args:
            dataset: an h5py dataset.

        Raises:
            InputError: if it is larger than the limit.
        """
        pairs = {*(dataset.dtype.names or ())}
        pairs = pairs if pairs in ({"real", "imag"}, {"r", "i"}) else set()
        if dataset.shape is None or (dataset.dtype.kind not in "biufc" and not pairs):
            return None
        plan = dataset.id.get_create_plist()
        if dataset.is_virtual or plan.get_external_count():
            self.left_out.append(f"{dataset.name!r} is kept in another file and is left out.")
            return None
        used = [plan.get_filter(i)[0] for i in range(plan.get_nfilters())]
        if not _FILTERS.issuperset(used):
            self.left_out.append(f"{dataset.name!r} is packed by a filter that is not built in and is left out.")
            return None
        self.used += int(dataset.size) * max(dataset.dtype.itemsize, 8)
        check_room(self.used, self.limit, self.path, f"dataset {dataset.name!r}")
        if dataset.chunks is not None:
            check_room(int(np.prod(dataset.chunks)) * dataset.dtype.itemsize, self.limit, self.path, "one chunk")
        elif dataset.id.get_storage_size() not in (0, int(dataset.size) * dataset.id.get_type().get_size()):
            raise InputError(f"{str(self.path)!r} holds only a part of {dataset.name!r}. Copy or export it again.")
        values = dataset[()]
        if pairs:
            real, imaginary = ("real", "imag") if "real" in pairs else ("r", "i")
            values = np.asarray(values[real]) + 1j * np.asarray(values[imaginary])
        return np.asarray(values)

    def attribute(self, owner: Any, *names: str) -> Any:
        """The first attribute there is of these; None if there is none that is small and plain.

        Args:
            owner: an h5py object.
            names: names of attributes, in any case.
        """
        known = {str(name).lower(): name for name in owner.attrs}
        for name in names:
            if name in known and self._is_small(owner.attrs.get_id(known[name])):
                value = owner.attrs[known[name]]
                return value.reshape(-1)[0] if isinstance(value, np.ndarray) and value.size == 1 else value
        return None

    def _is_small(self, attribute: Any) -> bool:
        """Whether an attribute takes no more than 64 KiB, as it declares and as it is stored."""
        declared = int(np.prod(attribute.shape)) * max(attribute.dtype.itemsize, 1)
        return max(declared, attribute.get_storage_size()) <= 65536
