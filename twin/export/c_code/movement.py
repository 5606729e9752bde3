"""Operations that only move numbers. JAX itself says, of an array of positions, what moves where."""

import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from twin.export.c_code.value import Value, kind_of
from twin.export.c_code.writer import Writer

_MOVES = (
    "broadcast_in_dim",
    "reshape",
    "transpose",
    "squeeze",
    "expand_dims",
    "rev",
    "slice",
    "concatenate",
    "pad",
    "stack",
    "split",
)


def write_movement(writer: Writer, name: str, operands: list[Value], equation: Any) -> list[Value] | None:
    """Write an operation that moves numbers, or makes them up; None where it is not one.

    Args:
        writer: text so far.
        name: JAX's name of the operation.
        operands: what it is applied to.
        equation: JAX's equation, for its settings and its results.
    """
    if name == "iota":
        params, aval = equation.params, equation.outvars[0].aval
        with jax.ensure_compile_time_eval():
            numbers = jax.lax.broadcasted_iota(params["dtype"], params["shape"], params["dimension"])
        return [writer.constant(np.asarray(numbers).reshape(aval.shape))]
    if name not in _MOVES:
        return None
    starts = np.cumsum([0] + [operand.size for operand in operands])
    positions = [
        jnp.arange(start, start + operand.size, dtype=jnp.int64).reshape(operand.shape)
        for start, operand in zip(starts, operands, strict=False)
    ]
    with jax.ensure_compile_time_eval():
        moved = equation.primitive.bind(*positions, **equation.params)
    results = moved if equation.primitive.multiple_results else [moved]
    sources = operands
    return [
        _gathered(writer, sources, starts, np.asarray(m), v.aval)
        for m, v in zip(results, equation.outvars, strict=True)
    ]


def _gathered(writer: Writer, sources: list[Value], starts: np.ndarray, positions: np.ndarray, aval: Any) -> Value:
    """The numbers at positions in all operands laid end to end."""
    flat, kind = positions.reshape(-1), kind_of(aval)
    used = [k for k in range(len(sources)) if np.any((flat >= starts[k]) & (flat < starts[k + 1]))]
    if len(used) == 1:
        source, local = sources[used[0]], flat - starts[used[0]]
        if source.size == math.prod(aval.shape) and np.array_equal(local, np.arange(source.size)):
            return Value(source.name, aval.shape, kind, source.pointer)
        return writer.elements(aval.shape, kind, lambda i: source.at(writer.index(local, i)))
    target = writer.declare(aval.shape, kind)
    begin = 0
    owner = np.searchsorted(starts, flat, side="right") - 1
    while begin < flat.size:
        # A run from one operand at an even stride is one loop.
        k = int(owner[begin])
        end = begin + 1
        while (
            end < flat.size
            and owner[end] == k
            and (end < begin + 2 or flat[end] - flat[end - 1] == flat[begin + 1] - flat[begin])
        ):
            end += 1
        source, local = sources[k], flat[begin:end] - starts[k]
        if end - begin == 1:
            writer.line(f"{target.at(str(begin))} = {source.at(str(local[0]))};")
        else:
            at = f"{begin} + i" if begin else "i"
            writer.line(
                f"for (int i = 0; i < {end - begin}; ++i) {target.name}[{at}] = {source.at(writer.index(local))};"
            )
        begin = end
    return target
