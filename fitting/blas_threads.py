"""One thread inside NumPy's linear algebra, for callers that run several of it side by side.

OpenBLAS splits even a small eigenproblem among all cores, and where these are busy its threads wait for each other:
seen were 18 ms instead of 0.4 ms for 62 unknowns. Many small problems are better shared out whole.
"""

import contextlib
import ctypes
import functools
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

_PLACES = ("../numpy.libs", ".dylibs")
_SUFFIXES = ("64_", "")


@contextlib.contextmanager
def one_blas_thread() -> Iterator[None]:
    """While this lasts, NumPy's OpenBLAS uses one thread in the whole process; other libraries are left as they are."""
    found = _thread_functions()
    before = [get() for get, _ in found]
    try:
        for _, put in found:
            put(1)
        yield
    finally:
        for (_, put), count in zip(found, before, strict=True):
            put(count)


@functools.cache
def _thread_functions() -> list[tuple[Callable[[], int], Callable[[int], None]]]:
    """Getter and setter of the number of threads of each OpenBLAS that came with NumPy."""
    functions = []
    for place in _PLACES:
        for path in sorted((Path(np.__file__).parent / place).glob("*openblas*")):
            library = ctypes.CDLL(str(path))
            for prefix in ("scipy_openblas", "openblas"):
                for suffix in _SUFFIXES:
                    names = [f"{prefix}_{what}_num_threads{suffix}" for what in ("get", "set")]
                    if all(hasattr(library, name) for name in names):
                        get, put = (getattr(library, name) for name in names)
                        get.restype, put.argtypes, put.restype = ctypes.c_int, [ctypes.c_int], None
                        functions.append((get, put))
    return functions
