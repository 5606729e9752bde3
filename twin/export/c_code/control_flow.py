"""Loops and branches, and programs called within programs."""

from collections.abc import Callable
from typing import Any

import numpy as np

from twin.export.c_code.value import Value, kind_of
from twin.export.c_code.writer import Writer

Translate = Callable[[Writer, Any, list[Value]], list[Value]]
"""Writes a closed program on operands, and returns its results."""

# Where an operation that calls another program keeps it.
_CALLED = ("call_jaxpr", "jaxpr", "fun_jaxpr", "call")


def write_control_flow(
    writer: Writer, name: str, operands: list[Value], equation: Any, translate: Translate
) -> list[Value] | None:
    """Write a loop, a branch or a call; None where it is none.

    Args:
        writer: text so far.
        name: JAX's name of the operation.
        operands: what it is applied to.
        equation: JAX's equation, for its programs and its results.
        translate: writes a program within this one.
    """
    params = equation.params
    if name == "scan":
        return _scan(writer, operands, equation, translate)
    if name == "while":
        return _while(writer, operands, params, translate)
    if name == "cond":
        return _cond(writer, operands, equation, translate)
    inner = next((params[key] for key in _CALLED if hasattr(params.get(key), "eqns")), None)
    return None if inner is None else translate(writer, inner, operands)


def _variables(writer: Writer, values: list[Value]) -> list[Value]:
    """Variables of their own that start at these values."""
    made = []
    for value in values:
        variable = writer.declare(value.shape, value.kind)
        writer.store(variable, value)
        made.append(variable)
    return made


def _assign(writer: Writer, targets: list[Value], sources: list[Value]) -> None:
    """All at once: a result may be another target's old value."""
    names = {target.name for target in targets}
    fresh = [
        _variables(writer, [source])[0] if source.name in names and source.name != target.name else source
        for target, source in zip(targets, sources, strict=True)
    ]
    for target, source in zip(targets, fresh, strict=True):
        if source.name != target.name:
            writer.store(target, source)


def _scan(writer: Writer, operands: list[Value], equation: Any, translate: Translate) -> list[Value]:
    params = equation.params
    constants, carries, length = params["num_consts"], params["num_carry"], params["length"]
    carry = _variables(writer, operands[constants : constants + carries])
    rows = operands[constants + carries :]
    stacked = [writer.declare(v.aval.shape, kind_of(v.aval)) for v in equation.outvars[carries:]]
    counter, step = writer.name("round"), writer.name("row")
    with writer.block(f"for (int {counter} = 0; {counter} < {length}; ++{counter})"):
        writer.line(f"const int {step} = {f'{length - 1} - {counter}' if params['reverse'] else counter};")
        items = [_row(writer, row, length, step) for row in rows]
        results = translate(writer, params["jaxpr"], [*operands[:constants], *carry, *items])
        for target, result in zip(stacked, results[carries:], strict=True):
            if length == 1 or target.size == 1:
                writer.store(target, result)
            else:
                writer.store(target, result, f"{step} * {result.size}" if result.size != 1 else step)
        _assign(writer, carry, results[:carries])
        writer.line(f"(void){step};")
    return [*carry, *stacked]


def _row(writer: Writer, rows: Value, length: int, step: str) -> Value:
    size = rows.size // max(length, 1)
    return writer.elements(rows.shape[1:], rows.kind, lambda i: rows.at(f"{step} * {size} + {i}"))


def _while(writer: Writer, operands: list[Value], params: Any, translate: Translate) -> list[Value]:
    first, second = params["cond_nconsts"], params["body_nconsts"]
    for_condition, for_body = operands[:first], operands[first : first + second]
    carry = _variables(writer, operands[first + second :])
    with writer.block("for (;;)"):
        (goes_on,) = translate(writer, params["cond_jaxpr"], [*for_condition, *carry])
        writer.line(f"if (!{goes_on.at('0')}) break;")
        _assign(writer, carry, translate(writer, params["body_jaxpr"], [*for_body, *carry]))
    return carry


def _cond(writer: Writer, operands: list[Value], equation: Any, translate: Translate) -> list[Value]:
    branches = equation.params["branches"]
    results = [writer.declare(v.aval.shape, kind_of(v.aval)) for v in equation.outvars]
    chosen = operands[0].at("0")
    limits = np.arange(len(branches) - 1)
    for number, branch in enumerate(branches):
        head = f"if (({chosen}) <= {limits[number]})" if number < limits.size else ""
        with writer.block(f"else {head}".strip() if number else head):
            for target, source in zip(results, translate(writer, branch, operands[1:]), strict=True):
                writer.store(target, source)
    return results
