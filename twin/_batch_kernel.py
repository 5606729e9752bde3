"""One chunk of a batch: its values, and which of its samples could not be computed and why."""

import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import numpy as np

from twin._batch_plan import rows_of
from twin._checks import InputError
from twin._tree_names import leaf_name
from twin.batch_result import blank

VMAP, LOOP, CHUNK = "vmap", "loop", "chunk"
MODES = (VMAP, LOOP, CHUNK)
BARE = "value"
"""Name of the output of a function that returns one array."""

Values = dict[str, np.ndarray]


class Computed(NamedTuple):
    """What came out of a chunk."""

    values: Values
    """Outputs by name, one row for each sample; of no rows at all where no sample could be computed."""
    raised: dict[int, str]
    """Messages of the samples that raised, by their row."""
    seconds: np.ndarray
    """Wall time of each sample [s]; that of the chunk shared out where samples are computed at once."""


def compute(fn: Callable[..., Any], mode: str, rows: Any, good: np.ndarray, width: int) -> Computed:
    """Compute a chunk.

    Args:
        fn: function of one sample, or of a chunk in mode "chunk".
        mode: "vmap", "loop" or "chunk".
        rows: the samples of the chunk.
        good: which of them are to be computed.
        width: samples that are computed at once, the chunk filled up with a good one.
    """
    numbers = np.flatnonzero(good)
    count, start = len(good), time.perf_counter()
    if numbers.size == 0:
        return Computed({}, {}, np.zeros(count))
    if mode == LOOP:
        return _one_by_one(fn, rows, numbers, count)

    def at(chosen: np.ndarray) -> Values:
        filled = np.concatenate([chosen, np.full(width - len(chosen), chosen[0])])
        picked = rows_of(rows, filled)
        values = _vmapped(fn, picked) if mode == VMAP else _whole(fn, picked, width)
        return {name: value[: len(chosen)] for name, value in values.items()}

    # What a compiled program raises as it runs is of a sample; anything else is of the function. Python tells neither.
    values, raised = _isolated(partial(_tried, at, RuntimeError if mode == VMAP else Exception), numbers)
    seconds = np.where(good, (time.perf_counter() - start) / numbers.size, 0.0)
    return Computed(_spread(values, [n for n in numbers if n not in raised], count), raised, seconds)


def _isolated(
    tried: Callable[[np.ndarray], tuple[Values, Exception | None]], numbers: np.ndarray
) -> tuple[Values, dict[int, str]]:
    """Values of all samples that do not raise.

    Every try takes as long as a whole chunk. One sample that raises is found by looking at one half alone each time;
    only if there are more, both halves are gone into.
    """
    values, error = tried(numbers)
    if error is None:
        return values, {}
    if len(numbers) == 1:
        return {}, {int(numbers[0]): _told(error)}
    suspects = numbers
    while len(suspects) > 1:
        half = len(suspects) // 2
        _, error = tried(suspects[:half])
        suspects = suspects[half:] if error is None else suspects[:half]
    _, guilty = tried(suspects)  # the error may have passed
    rest = numbers if guilty is None else numbers[numbers != suspects[0]]
    values, error = tried(rest)
    if error is None:
        return values, {} if guilty is None else {int(suspects[0]): _told(guilty)}
    half = len(numbers) // 2
    (first, a), (second, b) = _isolated(tried, numbers[:half]), _isolated(tried, numbers[half:])
    if not first or not second:
        return first or second, a | b
    return {name: np.concatenate([first[name], second[name]]) for name in first}, a | b


def _tried(
    at: Callable[[np.ndarray], Values], kind: type[Exception], numbers: np.ndarray
) -> tuple[Values, Exception | None]:
    """Values of some samples, or the error that one of them raised."""
    try:
        return at(numbers), None
    except InputError:
        raise
    except kind as error:
        # Of the device, not of a sample: too little memory is none of its doings.
        if "RESOURCE_EXHAUSTED" in str(error):
            raise InputError(
                f"A chunk of {len(numbers)} samples does not fit into memory. Give a smaller chunk_size. {error}"
            ) from error
        return {}, error


def _one_by_one(fn: Callable[..., Any], rows: Any, numbers: np.ndarray, count: int) -> Computed:
    found, raised, seconds = [], {}, np.zeros(count)
    for number in numbers:
        start = time.perf_counter()
        try:
            found.append(named(fn(jax.tree.map(lambda leaf, n=number: leaf[n], rows))))
        except Exception as error:
            raised[int(number)] = _told(error)
        seconds[number] = time.perf_counter() - start
    if not found:
        return Computed({}, raised, seconds)
    values = {}
    for name in found[0]:
        shapes = {one[name].shape for one in found if name in one}
        if len(shapes) > 1 or any(one.keys() != found[0].keys() for one in found):
            raise InputError(
                f"The function returns {name!r} in different shapes for different samples: {sorted(shapes)}. "
                "Return the same names and shapes for each."
            )
        values[name] = np.stack([one[name] for one in found])
    return Computed(_spread(values, [n for n in numbers if n not in raised], count), raised, seconds)


class _Named(eqx.Module):
    """Outputs in the order of their names, which a program carries along."""

    values: tuple[Any, ...]
    """The outputs."""
    names: tuple[str, ...] = eqx.field(static=True)
    """Their names."""


@eqx.filter_jit
def of_one(fn: Callable[..., Any], row: Any) -> Any:
    """Outputs at one sample. A program of its own, so that the function is traced once for all that is made of it."""
    values = _flat(fn(row))
    return _Named(tuple(jax.numpy.asarray(value) for value in values.values()), tuple(values))


@eqx.filter_jit
def _mapped(fn: Callable[..., Any], rows: Any) -> _Named:
    return jax.vmap(lambda row: of_one(fn, row))(rows)


def _vmapped(fn: Callable[..., Any], rows: Any) -> Values:
    found = _mapped(fn, rows)
    return dict(zip(found.names, jax.device_get(found.values), strict=True))


def _whole(fn: Callable[..., Any], rows: Any, width: int) -> Values:
    values = named(fn(rows))
    for name, value in values.items():
        if value.ndim == 0 or len(value) != width:
            raise InputError(f"The function of a chunk returned {name!r} of shape {value.shape} for {width} samples.")
    return values


def named(result: Any) -> Values:
    """What a function returned, as arrays by name.

    Raises:
        InputError: nothing, or what is no number.
    """
    values = {name: np.asarray(value) for name, value in _flat(result).items()}
    for name, value in values.items():
        if value.dtype.kind not in "fiubc":
            raise InputError(f"The function returned {value.dtype} values as {name!r}; return numbers.")
    return values


def _flat(result: Any) -> dict[str, Any]:
    # JAX sorts the keys of a dict, but names were given in the order of the caller.
    parts = result.items() if isinstance(result, Mapping) else [(None, result)]
    found = {}
    for key, part in parts:
        for path, leaf in jax.tree_util.tree_leaves_with_path(part):
            outer = [] if key is None else [str(key)]
            name = ".".join([*outer, *filter(None, [leaf_name(path)])]) or BARE
            if name in found:
                raise InputError(f"The function returns two outputs called {name!r}. Name each differently.")
            found[name] = leaf
    if not found:
        raise InputError("The function returned nothing. Return a number, an array, or several by name.")
    return found


def _spread(values: Values, numbers: Sequence[Any], count: int) -> Values:
    """Rows at their places; NaN, or zero for whole numbers, where there are none."""
    if len(numbers) == count:
        return values
    spread = {}
    for name, value in values.items():
        spread[name] = blank(count, value)
        spread[name][numbers] = value
    return spread


def _told(error: BaseException) -> str:
    """The message alone; those of compiled programs come between a trace and advice on how to debug."""
    kind, text = type(error).__name__, str(error).strip()
    text = text.split("\n-----", 1)[0].rsplit(f"{kind}: ", 1)[-1]
    return f"{kind}: {text.strip()[:500]}"
