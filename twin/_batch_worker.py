"""What a worker of an executor does with a chunk. A worker keeps the programs that it has compiled."""

import dataclasses
import functools
import pickle
import types
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import equinox as eqx
import jax
import numpy as np

from twin._batch_kernel import Computed, compute
from twin._checks import InputError
from twin._fingerprint import versions


class Failed(NamedTuple):
    """An error of the function itself, which is to be told from one of the executor."""

    error: Exception


def compute_here(fn: Any, mode: str, rows: Any, good: np.ndarray, width: int) -> Computed | Failed:
    """Compute a chunk in a thread of this process; arguments as of `twin._batch_kernel.compute`."""
    try:
        # A thread does not inherit what its starter set for a while.
        with jax.enable_x64(True):
            return compute(fn, mode, rows, good, width)
    except Exception as error:
        return Failed(error)


def compute_remotely(payload: bytes, rows: Any, good: np.ndarray, width: int) -> Computed | Failed:
    """Compute a chunk in a worker.

    Args:
        payload: function, mode and versions, see `packed_job`.
        rows: the samples of the chunk.
        good: which of them are to be computed.
        width: samples that are computed at once.
    """
    try:
        # A worker may work in single precision, in which even the arrays of the function would be read.
        with jax.enable_x64(True):
            fn, mode, expected = _job(payload)
            for name, version in expected.items():
                if versions().get(name) != version:
                    raise InputError(
                        f"A worker has {name} {versions().get(name)}, but the study {version}. "
                        "Start the workers from the same environment."
                    )
            found = compute_here(fn, mode, rows, good, width)
    except Exception as error:
        found = Failed(error)
    return Failed(_sendable(found.error)) if isinstance(found, Failed) else found


def _sendable(error: Exception) -> Exception:
    """An error that cannot be read at the other end would end the executor."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error


def packed_job(fn: Any, mode: str) -> bytes:
    """A function as bytes for workers that were started anew; also one of a notebook.

    Raises:
        InputError: a function that cannot be sent, or a module of a class that is defined in the script or notebook.
    """
    import cloudpickle

    for module in _modules_in(fn):
        # A class sent by value is made before its fields are known, and JAX would find no arrays in it.
        if type(module).__module__ == "__main__" or "<locals>" in type(module).__qualname__:
            raise InputError(
                f"The class {type(module).__name__} cannot be sent to workers, as it is defined in the script, the "
                "notebook or a function. Put it in a file that they can import; plain functions may stay."
            )
    try:
        return cloudpickle.dumps((fn, mode, versions()))
    except Exception as error:
        raise InputError(
            f"The function cannot be sent to workers ({type(error).__name__}: {error}). Give a plain function or a "
            "module of arrays, without open files, locks or compiled functions inside."
        ) from error


def _modules_in(value: Any, seen: set[int] | None = None) -> Iterator[eqx.Module]:
    """Modules that go with a function: in its arguments, fields and closure, in the globals of a script's function."""
    seen = set() if seen is None else seen
    if id(value) in seen:
        return
    seen.add(id(value))
    inside: Iterable[Any] = ()
    if isinstance(value, eqx.Module):
        yield value
        inside = [getattr(value, field.name, None) for field in dataclasses.fields(value)]
    elif isinstance(value, functools.partial):
        inside = [value.func, *value.args, *value.keywords.values()]
    elif isinstance(value, dict):
        inside = value.values()
    elif isinstance(value, list | tuple):
        inside = value
    elif isinstance(value, types.MethodType):
        inside = (value.__self__,)
    elif isinstance(value, types.FunctionType):
        inside = [cell.cell_contents for cell in value.__closure__ or () if cell != types.CellType()]
        if value.__module__ == "__main__":
            inside += [value.__globals__[name] for name in value.__code__.co_names if name in value.__globals__]
    for one in inside:
        yield from _modules_in(one, seen)


@functools.lru_cache(maxsize=8)
def _job(payload: bytes) -> tuple[Any, str, dict[str, str]]:
    import cloudpickle

    try:
        return cloudpickle.loads(payload)
    except Exception as error:
        raise InputError(
            f"A worker cannot read the function ({type(error).__name__}: {error}). Put its module where the workers "
            "can import it, on PYTHONPATH for instance, and start them from the same environment."
        ) from error
