"""Reading and writing at positions that are only known when the program runs."""

import math
from typing import Any

import numpy as np

from twin.export.c_code.value import Value, kind_of
from twin.export.c_code.writer import Writer


def write_indexing(writer: Writer, name: str, operands: list[Value], equation: Any) -> list[Value] | None:
    """Write a look-up or an update at computed positions; None where it is none.

    Args:
        writer: text so far.
        name: JAX's name of the operation.
        operands: what it is applied to.
        equation: JAX's equation, for its settings and its result.
    """
    if name == "dynamic_slice":
        return [_slice(writer, operands[0], operands[1:], equation)]
    if name == "dynamic_update_slice":
        return [_update(writer, operands[0], operands[1], operands[2:])]
    return [_gather(writer, operands[0], operands[1], equation)] if name == "gather" else None


def _strides(shape: tuple[int, ...]) -> list[int]:
    return [math.prod(shape[axis + 1 :]) for axis in range(len(shape))]


def _start(writer: Writer, shape: tuple[int, ...], part: tuple[int, ...], starts: list[Value]) -> str:
    """Position of the first number of a part, drawn into the array as JAX does."""
    terms = []
    for axis, (stride, start) in enumerate(zip(_strides(shape), starts, strict=True)):
        room = shape[axis] - part[axis]
        if room > 0:
            terms.append(f"{stride} * dt_within((int64_t)({start.at('0')}), {room})")
    name = writer.name("first")
    writer.line(f"const int64_t {name} = {' + '.join(terms) or '0'};")
    return name


def _inside(shape: tuple[int, ...], part: tuple[int, ...]) -> np.ndarray:
    """Positions of the numbers of a part, from its first one."""
    grid = np.indices(part).reshape(len(part), -1)
    return np.asarray(_strides(shape)) @ grid if part else np.zeros(1, dtype=int)


def _slice(writer: Writer, source: Value, starts: list[Value], equation: Any) -> Value:
    aval, part = equation.outvars[0].aval, tuple(equation.params["slice_sizes"])
    first, inside = _start(writer, source.shape, part, starts), _inside(source.shape, part)
    return writer.elements(aval.shape, source.kind, lambda i: source.at(f"{first} + {writer.index(inside, i)}"))


def _update(writer: Writer, source: Value, part: Value, starts: list[Value]) -> Value:
    target = writer.declare(source.shape, source.kind)
    writer.store(target, source)
    first, inside = _start(writer, source.shape, part.shape, starts), _inside(source.shape, part.shape)
    loop = f"for (int i = 0; i < {part.size}; ++i) "
    writer.line(f"{loop}{target.at(f'{first} + {writer.index(inside)}')} = {part.at('i')};")
    return target


def _gather(writer: Writer, source: Value, indices: Value, equation: Any) -> Value:
    aval, params = equation.outvars[0].aval, equation.params
    numbers, sizes = params["dimension_numbers"], params["slice_sizes"]
    strides, result = _strides(source.shape), aval.shape
    grid = np.indices(result).reshape(len(result), -1) if result else np.zeros((0, 1), dtype=int)
    offset_axes = list(numbers.offset_dims)
    batch_axes = [axis for axis in range(len(result)) if axis not in offset_axes]
    window = [
        a for a in range(len(source.shape)) if a not in (*numbers.collapsed_slice_dims, *numbers.operand_batching_dims)
    ]
    inside = np.zeros(max(aval.size, 1), dtype=int)
    for axis, own in zip(offset_axes, window, strict=True):
        inside = inside + strides[own] * grid[axis]
    row = np.zeros(max(aval.size, 1), dtype=int)
    for axis, length in zip(batch_axes, indices.shape[:-1], strict=True):
        row = row * length + grid[axis]
    for own, theirs in zip(numbers.operand_batching_dims, numbers.start_indices_batching_dims, strict=True):
        inside = inside + strides[own] * grid[batch_axes[theirs]]
    depth, fill = indices.shape[-1], "FILL" in str(params["mode"])
    target = writer.declare(result, kind_of(aval))
    with writer.block(f"for (int i = 0; i < {target.size}; ++i)"):
        writer.line(f"int64_t at = {writer.index(inside)};")
        if fill:
            writer.line("bool found = true;")
        for k, axis in enumerate(numbers.start_index_map):
            room = source.shape[axis] - sizes[axis]
            position = indices.at(writer.index(row * depth + k))
            writer.line(f"at += {strides[axis]} * dt_within((int64_t)({position}), {room});")
            if fill:
                writer.line(f"found = found && (int64_t)({position}) >= 0 && (int64_t)({position}) <= {room};")
        empty = "NAN" if target.kind == "float64" else "0"
        value = f"found ? {source.at('at')} : {empty}" if fill else source.at("at")
        writer.line(f"{target.at('i')} = {value};")
    return target
