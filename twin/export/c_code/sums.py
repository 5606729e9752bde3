"""Sums, products and extremes over axes, running sums, and products of matrices."""

import math
from typing import Any

import numpy as np

from twin.export.c_code.value import Value, kind_of, literal
from twin.export.c_code.writer import Writer

# Start, and how one number more enters.
_REDUCTIONS = {
    "reduce_sum": (0, "{0} + {1}"),
    "reduce_prod": (1, "{0} * {1}"),
    "reduce_max": (None, "dt_max({0}, {1})"),
    "reduce_min": (None, "dt_min({0}, {1})"),
    "reduce_and": (True, "{0} & {1}"),
    "reduce_or": (False, "{0} | {1}"),
}
_RUNNING = {"cumsum": "{0} + {1}", "cumprod": "{0} * {1}", "cummax": "dt_max({0}, {1})", "cummin": "dt_min({0}, {1})"}
_CHOICES = {"argmax": ">", "argmin": "<"}


def write_sum(writer: Writer, name: str, operands: list[Value], equation: Any) -> list[Value] | None:
    """Write a reduction, a running one, or a product of matrices; None where it is none of these.

    Args:
        writer: text so far.
        name: JAX's name of the operation.
        operands: what it is applied to.
        equation: JAX's equation, for its settings and its result.
    """
    if name in _REDUCTIONS:
        return [_reduced(writer, name, operands[0], equation)]
    if name in _RUNNING:
        return [_running(writer, name, operands[0], equation)]
    if name in _CHOICES:
        return [_position(writer, name, operands[0], equation)]
    return [_product(writer, operands, equation)] if name == "dot_general" else None


def _along(shape: tuple[int, ...], axes: tuple[int, ...]) -> np.ndarray:
    """Positions (kept, along the axes)."""
    positions = np.arange(math.prod(shape)).reshape(shape)
    kept = [axis for axis in range(len(shape)) if axis not in axes]
    count = math.prod(shape[axis] for axis in kept)
    return positions.transpose(*kept, *axes).reshape(count, -1)


def _extreme(formula: str, kind: str) -> str:
    if kind == "float64" or "dt_" not in formula:
        return formula
    return "({0} > {1} ? {0} : {1})" if "max" in formula else "({0} < {1} ? {0} : {1})"


def _reduced(writer: Writer, name: str, operand: Value, equation: Any) -> Value:
    aval = equation.outvars[0].aval
    kind, (start, formula) = kind_of(aval), _REDUCTIONS[name]
    positions = _along(operand.shape, tuple(equation.params["axes"]))
    target, terms = writer.declare(aval.shape, kind), positions.shape[1]
    with writer.block(f"for (int j = 0; j < {target.size}; ++j)"):
        at = writer.index(positions, f"j * {terms} + k")
        first = operand.at(at.replace("+ k", "+ 0")) if start is None else literal(start, kind)
        writer.line(f"{operand.c_type} sum = {first};")
        step = _extreme(formula, kind).format("sum", operand.at(at))
        writer.line(f"for (int k = {int(start is None)}; k < {terms}; ++k) sum = {step};")
        writer.line(f"{target.at('j')} = sum;")
    return target


def _running(writer: Writer, name: str, operand: Value, equation: Any) -> Value:
    axis, backwards = equation.params["axis"], equation.params["reverse"]
    positions = _along(operand.shape, (axis,))
    positions = positions[:, ::-1] if backwards else positions
    target, terms = writer.declare(operand.shape, operand.kind), positions.shape[1]
    step = _extreme(_RUNNING[name], operand.kind)
    with writer.block(f"for (int j = 0; j < {positions.shape[0]}; ++j)"):
        at = writer.index(positions, f"j * {terms} + k")
        writer.line(f"{operand.c_type} sum = {operand.at(at.replace('+ k', '+ 0'))};")
        writer.line(f"{target.at(at.replace('+ k', '+ 0'))} = sum;")
        with writer.block(f"for (int k = 1; k < {terms}; ++k)"):
            writer.line(f"sum = {step.format('sum', operand.at(at))};")
            writer.line(f"{target.at(at)} = sum;")
    return target


def _position(writer: Writer, name: str, operand: Value, equation: Any) -> Value:
    aval, sign = equation.outvars[0].aval, _CHOICES[name]
    positions = _along(operand.shape, tuple(equation.params["axes"]))
    target, terms = writer.declare(aval.shape, kind_of(aval)), positions.shape[1]
    with writer.block(f"for (int j = 0; j < {target.size}; ++j)"):
        at = writer.index(positions, f"j * {terms} + k")
        writer.line(f"int best = 0; {operand.c_type} most = {operand.at(at.replace('+ k', '+ 0'))};")
        with writer.block(f"for (int k = 1; k < {terms}; ++k)"):
            new = operand.at(at)
            # What is not a number counts as the most, and the first of equals wins.
            better = f"({new} {sign} most || ({new} != {new} && most == most))"
            writer.line(f"if {better} {{ best = k; most = {new}; }}")
        writer.line(f"{target.at('j')} = best;")
    return target


def _product(writer: Writer, operands: list[Value], equation: Any) -> Value:
    aval = equation.outvars[0].aval
    (left_sum, right_sum), (left_batch, right_batch) = equation.params["dimension_numbers"]
    left, batch, terms = _rows(operands[0].shape, tuple(left_batch), tuple(left_sum))
    right, _, _ = _rows(operands[1].shape, tuple(right_batch), tuple(right_sum))
    target, rows, columns = (
        writer.declare(aval.shape, kind_of(aval)),
        left.size // (batch * terms),
        right.size // (batch * terms),
    )
    with (
        writer.block(f"for (int b = 0; b < {batch}; ++b)"),
        writer.block(f"for (int m = 0; m < {rows}; ++m)"),
        writer.block(f"for (int n = 0; n < {columns}; ++n)"),
    ):
        one = operands[0].at(writer.index(left, f"(b * {rows} + m) * {terms} + k"))
        other = operands[1].at(writer.index(right, f"(b * {columns} + n) * {terms} + k"))
        writer.line(f"{target.c_type} sum = 0;")
        writer.line(f"for (int k = 0; k < {terms}; ++k) sum += {one} * {other};")
        writer.line(f"{target.at(f'(b * {rows} + m) * {columns} + n')} = sum;")
    return target


def _rows(shape: tuple[int, ...], batch: tuple[int, ...], summed: tuple[int, ...]) -> tuple[np.ndarray, int, int]:
    """Positions in the order (batch, rest, summed), and the counts of the first and the last."""
    rest = [axis for axis in range(len(shape)) if axis not in (*batch, *summed)]
    positions = np.arange(math.prod(shape)).reshape(shape).transpose(*batch, *rest, *summed).reshape(-1)
    return positions, math.prod(shape[axis] for axis in batch), math.prod(shape[axis] for axis in summed)
