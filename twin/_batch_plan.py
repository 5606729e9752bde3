"""Which samples of a batch are computed together: chunks of one shape, in an order."""

import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np
from jax.extend.core import ClosedJaxpr

from twin._checks import InputError
from twin._cores import usable_cores
from twin._lapack import LAPACK, equations_of, traced
from twin._tree_names import leaf_name

WIDEST = 256
"""Samples computed at once on a processor: wider chunks wait longer for their slowest sample and leave the cache."""
WIDEST_WITHOUT_LOOPS = 4096
"""The same where no sample can be slower than another."""
WIDEST_ON_ACCELERATOR = 8192
_NARROW = 8
_BYTES = 2**26
"""Memory for the largest intermediate result of a chunk."""


class Plan(NamedTuple):
    """Chunks of one width; the last one is filled up when it is computed."""

    order: np.ndarray
    """Numbers of the samples, in the order in which they are computed (samples,)."""
    width: int
    """Samples in a chunk."""

    @property
    def chunks(self) -> int:
        """Number of chunks."""
        return chunk_count(len(self.order), self.width)

    def members(self, chunk: int) -> np.ndarray:
        """Numbers of the samples in a chunk."""
        return self.order[chunk * self.width : (chunk + 1) * self.width]


def chunk_count(samples: int, width: int) -> int:
    """Number of chunks of so many samples."""
    return -(-samples // width)


def second_width(width: int) -> int:
    """Samples computed at once in the second try: few, as they take long."""
    return min(_NARROW, width)


class Traits(NamedTuple):
    """What a program tells about how to run it."""

    lapack: bool
    """Whether it calls LAPACK, so that it must run alone in its process."""
    loops: bool
    """Whether it holds a loop, so that one sample can take longer than another."""
    bytes: int
    """Size of its largest intermediate result for one sample."""


def as_samples(samples: Any) -> tuple[Any, int]:
    """Samples as NumPy arrays with one first axis, and how many they are.

    Args:
        samples: array, or any structure of arrays, or a table of columns.

    Raises:
        InputError: no samples, texts or objects, samples of unequal length.
    """
    if hasattr(samples, "columns") and hasattr(samples, "to_numpy"):
        samples = {str(name): samples[name].to_numpy() for name in samples.columns}
    elif isinstance(samples, list):
        samples = np.asarray(samples)
    lengths, names = {}, set()
    for path, leaf in jax.tree_util.tree_leaves_with_path(samples):
        name = f"samples{jax.tree_util.keystr(path)}"
        if leaf_name(path) in names:
            raise InputError(f"Two arrays of the samples are called {leaf_name(path)!r}. Name each differently.")
        names.add(leaf_name(path))
        array = np.asarray(leaf)
        if array.dtype.kind not in "fiubc":
            raise InputError(f"{name} holds {array.dtype} values, but numbers were expected.")
        if array.ndim == 0:
            raise InputError(f"{name} is a single number; give an array with one entry for each sample.")
        lengths[name] = len(array)
    if not lengths or not all(lengths.values()):
        raise InputError("There are no samples. Give an array, or a dict of arrays, with one row for each sample.")
    if len(set(lengths.values())) > 1:
        seen = ", ".join(f"{name} has {length}" for name, length in lengths.items())
        raise InputError(f"The samples are of unequal length: {seen}. Give each sample a row in every array.")
    return jax.tree.map(_in_double, samples), next(iter(lengths.values()))


def _in_double(leaf: Any) -> np.ndarray:
    """Numbers as they are computed with: those with a fraction in double precision."""
    array = np.asarray(leaf)
    return array.astype({"f": np.float64, "c": np.complex128}.get(array.dtype.kind, array.dtype), copy=False)


def whole_rows(samples: Any, count: int) -> np.ndarray:
    """Which samples hold no NaN; infinity passes, as for a limit that is not there (samples,)."""
    good = np.ones(count, dtype=bool)
    for leaf in jax.tree.leaves(samples):
        if leaf.dtype.kind in "fc":
            good &= ~np.isnan(leaf.reshape(count, -1)).any(axis=1)
    return good


def rows_of(samples: Any, numbers: np.ndarray) -> Any:
    """Some of the samples, in their structure."""
    return jax.tree.map(lambda leaf: leaf[numbers], samples)


def ordered(difficulty: Any, count: int) -> np.ndarray:
    """Order of the samples, the hardest first: alike ones share a chunk, and no long chunk comes last.

    Args:
        difficulty: expected effort for each sample, in any unit; None where it is not known.
        count: number of samples.

    Raises:
        InputError: another length, NaN.
    """
    if difficulty is None:
        return np.arange(count)
    effort = np.asarray(difficulty, dtype=float)
    if effort.shape != (count,) or np.isnan(effort).any():
        raise InputError(
            f"difficulty must be one number for each of the {count} samples, but has the shape {effort.shape}"
            f"{' and holds NaN' if np.isnan(effort).any() else ''}."
        )
    return np.argsort(-effort, kind="stable")


def traits(compiled: Callable[..., Any], function: Callable[..., Any], row: Any) -> Traits:
    """What the program of a function tells.

    Args:
        compiled: calls a function with a sample.
        function: the function.
        row: a sample.
    """
    program = traced(compiled, function, jax.tree.map(jax.numpy.asarray, row))
    # JAX keeps what it has traced of a compiled function: to look through it again would take longer than to run it.
    inner = [equation.params.get("jaxpr") for equation in program.eqns]
    return _traits(inner[0]) if len(inner) == 1 and isinstance(inner[0], ClosedJaxpr) else _look_through(program)


@functools.lru_cache(maxsize=64)
def _traits(program: ClosedJaxpr) -> Traits:
    return _look_through(program.jaxpr)


def _look_through(program: Any) -> Traits:
    equations = list(equations_of(program))
    names = {equation.primitive.name for equation in equations}
    sizes = [_size(variable.aval) for equation in equations for variable in equation.outvars]
    return Traits(not names.isdisjoint(LAPACK), not names.isdisjoint(("while", "scan")), max(sizes, default=8))


def automatic_width(count: int, known: Traits | None) -> int:
    """Samples in a chunk. The same on every machine with one kind of device, whatever else it does meanwhile.

    Args:
        count: number of samples.
        known: traits of the program; None for functions that are not compiled, which are called sample by sample.
    """
    if known is None:
        return max(1, count // 1000)
    widest = WIDEST if known.loops else WIDEST_WITHOUT_LOOPS
    if jax.default_backend() != "cpu":
        widest = WIDEST_ON_ACCELERATOR
    least = min(32, _power_of_two(count))
    wanted = min(widest, max(least, _power_of_two(-(-count // 8))))
    fitting = 2 ** int(np.log2(max(1, _BYTES // max(1, known.bytes))))
    return min(wanted, fitting)


def streams(known: Traits | None) -> int:
    """Chunks that run side by side in this process: one for each device, or else for each core."""
    if known is None or known.lapack:
        return 1
    if jax.local_device_count() > 1:
        return jax.local_device_count()
    return len(usable_cores()) if jax.default_backend() == "cpu" else 1


def _power_of_two(number: int) -> int:
    return 1 << max(0, number - 1).bit_length()


def _size(aval: Any) -> int:
    return math.prod(getattr(aval, "shape", ())) * getattr(getattr(aval, "dtype", None), "itemsize", 8)
