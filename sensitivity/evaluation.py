"""A function's outputs at many samples: batched, named, and refused when one of them is not finite."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, require_x64
from twin.batch import batched
from twin.parameters import ParameterSpace

_BARE = "f(x)"
"""Name of the output of a function that names none."""


def evaluate(
    fn: Callable[..., Any],
    space: ParameterSpace,
    values: Float[ArrayLike, "rows parameters"],
    *,
    model: Any = None,
    chunk: int | str = 256,
    seed: int | None = None,
    store: str | Path | None = None,
    executor: Executor | None = None,
    progress: bool = True,
) -> Any:
    """Outputs of a function at many samples, by `twin.batch.batched`.

    Args:
        fn: JAX function of the values in SI (parameters,), or of the model if one is given. It returns a number, a
            vector, or a dict of such. Define it once and keep it: a new lambda compiles anew.
        space: the parameters that the columns stand for.
        values: samples (rows, parameters), SI.
        model: model whose parameters take the values; None where `fn` takes the vector.
        chunk: samples evaluated at once. More are not faster once the processor is busy, and take memory.
        seed: what the samples were drawn with, for the store.
        store: folder that keeps what was evaluated, so that a study that was killed goes on.
        executor: where it is evaluated, see `twin.batch.batched`; None for this process.
        progress: show a bar.

    Returns:
        What `fn` returns, with the samples as first axis of every array.

    Raises:
        InputError: not one column per parameter, a chunk that is no positive number, a sample at which `fn` raises, a
            store that holds another study.
    """
    require_x64()
    rows = np.asarray(values, dtype=float)
    if rows.ndim != 2 or rows.shape[1] != len(space) or rows.shape[0] == 0:
        raise InputError(
            f"values has the shape {rows.shape}, but one row per sample and one column for each of the {len(space)} "
            "parameters were expected."
        )
    if isinstance(chunk, int) and chunk < 1:
        raise InputError(f"chunk must be at least 1, but is {chunk}.")
    found = batched(
        _AtValues(fn, space, model),
        rows,
        chunk_size=chunk,
        seed=seed,
        store=store,
        executor=executor,
        progress=progress,
    )
    if found.messages:
        raise InputError(f"The function failed at some samples. {found.message}")
    outputs = dict(found.outputs.items())
    return outputs[_BARE] if list(outputs) == [_BARE] else outputs


class _AtValues(eqx.Module):
    """A function of the values, by way of the model if there is one."""

    fn: Callable[..., Any]
    """The function."""
    space: ParameterSpace
    """The parameters."""
    model: Any
    """The model, or None."""

    def __call__(self, row: Float[Array, "n"]) -> Any:
        """Outputs by name.

        Args:
            row: values in SI.
        """
        done = self.fn(row if self.model is None else self.space.with_values(self.model, row))
        found = dict(done) if isinstance(done, Mapping) else {_BARE: done}
        if not all(eqx.is_array_like(value) for value in found.values()):
            raise InputError(f"The function returned {done!r}. Return a number, a vector, or a dict of such.")
        return found


def named_columns(values: Any, outputs: Sequence[str] | None, rows: int) -> tuple[np.ndarray, tuple[str, ...]]:
    """Outputs as one matrix, and their names.

    Args:
        values: (rows,), (rows, outputs), or a dict of such; an entry with several columns is numbered from 0.
        outputs: names; None for those of the dict, or else "0", "1" and so on.
        rows: number of samples.

    Returns:
        Matrix (rows, outputs), and as many names.

    Raises:
        InputError: complex or text values, arrays of more axes, other lengths or another number of names, a name twice.
    """
    if isinstance(values, Mapping):
        columns, names = [], []
        for key, entry in values.items():
            column = _matrix(entry, str(key), rows)
            wide = np.ndim(entry) > 1
            columns.append(column)
            names += [f"{key} {i}" for i in range(column.shape[1])] if wide else [str(key)]
        matrix = np.concatenate(columns, axis=1)
    else:
        matrix = _matrix(values, "values", rows)
        names = [str(i) for i in range(matrix.shape[1])]
    names = tuple(names if outputs is None else outputs)
    if len(names) != matrix.shape[1]:
        raise InputError(f"outputs holds {len(names)} names, but there are {matrix.shape[1]} outputs. Name each once.")
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise InputError(f"The output name {twice[0]!r} is given twice. Name each output differently.")
    return matrix, names


def _matrix(values: Any, name: str, rows: int) -> np.ndarray:
    array = np.asarray(values)
    if array.ndim not in (1, 2) or array.size == 0 or array.shape[0] != rows:
        raise InputError(
            f"{name} has the shape {array.shape}, but {rows} rows were expected, one per sample in order, and one "
            "column per output. Return a number, a vector, or a dict of such for each sample."
        )
    if not (np.issubdtype(array.dtype, np.number) or array.dtype == bool) or np.iscomplexobj(array):
        raise InputError(
            f"{name} holds {array.dtype} values, but a variance needs real numbers. "
            "Return real and imaginary part, or amplitude and phase, as two outputs."
        )
    return np.asarray(array, dtype=float).reshape(array.shape[0], -1)


def require_finite(
    matrix: np.ndarray, names: Sequence[str], space: ParameterSpace, values: np.ndarray, what: str = "Output"
) -> None:
    """Raise unless every output of every sample is finite: one NaN would turn all indices to zero without a word.

    Args:
        matrix: outputs (rows, outputs).
        names: their names.
        space: the parameters.
        values: samples (rows, parameters), SI.
        what: what the columns are, for the message.

    Raises:
        InputError: naming the first output and sample concerned, and the sample's parameters.
    """
    bad = ~np.isfinite(matrix)
    if not bad.any():
        return
    row, column = np.argwhere(bad)[0]
    given = ", ".join(
        f"{p.path} = {value:.10g}{' ' + p.unit if p.unit else ''}"
        for p, value in zip(space.parameters, values[row], strict=True)
    )
    raise InputError(
        f"{what} {names[column]!r} of sample {row} is {matrix[row, column]}, at {given}. In all, "
        f"{bad.any(axis=1).sum()} of {len(matrix)} samples are not finite. Repair the model there, or narrow the "
        "bounds; samples are never left out, as the estimators need the design complete."
    )
