"""A function's outputs at many samples: batched, named, and refused when one of them is not finite."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, require_x64
from twin.parameters import ParameterSpace


def evaluate(
    fn: Callable[..., Any],
    space: ParameterSpace,
    values: Float[ArrayLike, "rows parameters"],
    *,
    model: Any = None,
    chunk: int = 256,
) -> Any:
    """Outputs of a function at many samples, compiled once and mapped over chunks of one shape.

    Args:
        fn: JAX function of the values in SI (parameters,), or of the model if one is given. It returns a number, a
            vector, or a dict of such. Define it once and keep it: a new lambda compiles anew.
        space: the parameters that the columns stand for.
        values: samples (rows, parameters), SI.
        model: model whose parameters take the values; None where `fn` takes the vector.
        chunk: samples evaluated at once. More are not faster once the processor is busy, and take memory.

    Returns:
        What `fn` returns, with the samples as first axis of every array.

    Raises:
        InputError: not one column per parameter, a chunk that is no positive number.
    """
    require_x64()
    rows = np.asarray(values, dtype=float)
    if rows.ndim != 2 or rows.shape[1] != len(space) or rows.shape[0] == 0:
        raise InputError(
            f"values has the shape {rows.shape}, but one row per sample and one column for each of the {len(space)} "
            "parameters were expected."
        )
    if chunk < 1:
        raise InputError(f"chunk must be at least 1, but is {chunk}.")
    chunk = min(chunk, rows.shape[0])
    parts = []
    keys: tuple[Any, ...] = ()
    for start in range(0, rows.shape[0], chunk):
        part = rows[start : start + chunk]
        # The last chunk is filled up with its own first row: another shape would be compiled once more.
        full = np.concatenate([part, np.repeat(part[:1], chunk - len(part), axis=0)])
        done, keys = _mapped(fn, space, model, jnp.asarray(full))
        parts.append(jax.tree.map(np.asarray, done))
    found = jax.tree.map(lambda *x: np.concatenate(x)[: rows.shape[0]], *parts)
    return dict(zip(keys, found, strict=True)) if keys else found


@eqx.filter_jit
def _mapped(
    fn: Callable[..., Any], space: ParameterSpace, model: Any, rows: Float[Array, "rows n"]
) -> tuple[Any, tuple[Any, ...]]:
    keys: tuple[Any, ...] = ()

    def one(row: Float[Array, "n"]) -> Any:
        nonlocal keys
        done = fn(row if model is None else space.with_values(model, row))
        if not isinstance(done, Mapping):
            return done
        # JAX sorts the keys of a dict, but names were given in the order of the caller.
        keys = tuple(done)
        return list(done.values())

    return jax.vmap(one)(rows), keys


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
