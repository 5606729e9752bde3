"""A first reading of an HDF5 file in a process of its own, which may hang, crash or run out of memory in its stead.

The HDF5 library trusts what a file declares of itself in places where no caller can look first: a damaged heap of
variable-length text makes it loop for ever or allocate gigabytes, and other damage has made it write beyond its memory.
Run as a script; it imports nothing of this package. Its exit status is 0 if the library came to an end within the
memory allowed. Errors that it reports itself count for nothing here: the reader meets and tells them.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

_ROOM = 1_000_000_000
"""Bytes of address space beyond the samples: interpreter, libraries and attributes."""
_MOST_OBJECTS, _DEEPEST = 100_000, 24
TOO_LARGE = 3
"""Exit status where memory did not suffice."""


def main(path: str, limit: int) -> None:
    """Read all attributes, then all datasets no larger than the limit.

    Args:
        path: the file.
        limit: bytes of samples.
    """
    import h5py
    import numpy as np  # before the limit is set

    _allow(_ROOM)
    with h5py.File(path, "r", locking=False) as file:
        datasets = []
        for found in _members(file, h5py, set(), 0):
            _touch_attributes(found)
            if isinstance(found, h5py.Dataset):
                datasets.append(found)
        _allow(_ROOM + 3 * limit)
        for dataset in datasets:
            size = int(dataset.size or 0) * max(dataset.dtype.itemsize, 8)
            chunk = int(np.prod(dataset.chunks)) * dataset.dtype.itemsize if dataset.chunks else 0
            if size <= limit and chunk <= limit and not dataset.is_virtual and dataset.external is None:
                with _told_later():
                    dataset[()]


def _members(group: Any, h5py: Any, seen: set[int], depth: int) -> Iterator[Any]:
    yield group
    for name in group:
        with _told_later():
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                continue
            member = group[name]
            address = h5py.h5o.get_info(member.id).addr
            if address in seen or len(seen) > _MOST_OBJECTS:
                continue
            seen.add(address)
            if isinstance(member, h5py.Group) and depth < _DEEPEST:
                yield from _members(member, h5py, seen, depth + 1)
            else:
                yield member


def _touch_attributes(owner: Any) -> None:
    names = []
    with _told_later():
        names = list(owner.attrs)
    for name in names:
        with _told_later():
            owner.attrs[name]


@contextmanager
def _told_later() -> Iterator[None]:
    try:
        yield
    except MemoryError:
        raise
    except Exception as error:
        if "alloc" in str(error).lower():
            raise MemoryError(str(error)) from error


def _allow(size: int) -> None:
    """Limit this process's address space, where the system can."""
    try:
        import resource
    except ImportError:
        return
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_AS, (size if hard < 0 else min(size, hard), hard))


if __name__ == "__main__":
    try:
        main(sys.argv[1], int(sys.argv[2]))
    except MemoryError:
        sys.exit(TOO_LARGE)
    except OSError:
        pass
