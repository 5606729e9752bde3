"""A JAX function of arrays as a C function of pointers to numbers."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from jax.extend.core import Literal
from jax.interpreters import partial_eval

from twin._checks import InputError
from twin.export.c_code.control_flow import write_control_flow
from twin.export.c_code.elementwise import write_elementwise
from twin.export.c_code.indexing import write_indexing
from twin.export.c_code.movement import write_movement
from twin.export.c_code.sums import write_sum
from twin.export.c_code.value import Value, kind_of
from twin.export.c_code.writer import Writer

_RULES = (write_elementwise, write_movement, write_sum, write_indexing)


@dataclass(frozen=True)
class CFunction:
    """A function in C."""

    text: str
    """Its source, with the tables that it needs before it; it includes nothing."""
    used: tuple[tuple[bool, ...], ...]
    """For each group of arguments, whether each array is used at all."""


def c_function(name: str, function: Callable, groups: tuple[tuple[str, list], ...]) -> CFunction:
    """Translate a function of lists of arrays.

    The C function takes a `const double *` for each list, in which all numbers stand one after the other, and writes
    the results one after the other to a last pointer. It calls nothing but the C library and `arithmetic.h`.

    Args:
        name: name of the C function.
        function: function of one list of arrays for each group, that returns a list of arrays.
        groups: for each argument its name in C and the arrays, of which only shapes and types matter.

    Raises:
        InputError: an operation or a type of number that has no translation; it is named.
    """
    shapes = [[jax.ShapeDtypeStruct(np.shape(a), np.asarray(a).dtype) for a in arrays] for _, arrays in groups]
    closed = jax.make_jaxpr(function)(*shapes)
    # What only served the estimate of the error is left out.
    program, used = partial_eval.dce_jaxpr(closed.jaxpr, [True] * len(closed.jaxpr.outvars))
    writer = Writer()
    flags, operands = iter(used), []
    given: list[tuple[bool, ...]] = []
    for argument, arrays in groups:
        kept, offset = [], 0
        for array in arrays:
            kept.append(next(flags))
            if kept[-1]:
                operands.append(_argument(writer, argument, offset, np.shape(array), np.asarray(array).dtype.name))
            offset += int(np.size(array))
        given.append(tuple(kept))
    constants = [writer.constant(np.asarray(value)) for value in closed.consts]
    results = _program(writer, program, constants, operands)
    offset = 0
    for result in results:
        writer.line(f"// result {offset}")
        writer.store(Value("result", (0, 0), "float64"), result, str(offset))
        offset += result.size
    tables = [f"static const {text.replace('NAME', table)}" for text, table in writer.tables.items()]
    arguments = ", ".join(f"const double *{argument}" for argument, _ in groups)
    unused = "".join(f"    (void){argument};\n" for argument, _ in groups)
    body = "\n".join(writer.lines)
    head = f"void {name}({arguments}, double *result)"
    prefix = "\n".join(tables).replace("table", f"{name}_table")
    body = body.replace("table", f"{name}_table")
    return CFunction("\n".join(filter(None, [prefix, f"{head}\n{{\n{unused}{body}\n}}"])) + "\n", tuple(given))


def _argument(writer: Writer, argument: str, offset: int, shape: tuple[int, ...], kind: str) -> Value:
    memory = Value(f"({argument} + {offset})" if offset else argument, shape, "float64", pointer=True)
    if kind == "float64" and memory.size != 1:
        return memory
    return writer.elements(shape, kind, lambda i: memory.at(i) if kind == "float64" else f"({memory.at(i)})")


def _closed(writer: Writer, program: Any, operands: list[Value]) -> list[Value]:
    """A program within another; JAX keeps its constants with it."""
    inner = getattr(program, "jaxpr", program)
    constants = [writer.constant(np.asarray(value)) for value in getattr(program, "consts", ())]
    return _program(writer, inner, constants, operands)


def _program(writer: Writer, program: Any, constants: list[Value], operands: list[Value]) -> list[Value]:
    known: dict[Any, Value] = {}
    known.update(zip(program.constvars, constants, strict=True))
    known.update(zip(program.invars, operands, strict=True))

    def read(atom: Any) -> Value:
        if isinstance(atom, Literal):
            aval: Any = atom.aval
            return writer.constant(np.asarray(atom.val, dtype=aval.dtype))
        return known[atom]

    for equation in program.eqns:
        results = _equation(writer, equation, [read(atom) for atom in equation.invars])
        known.update(zip(equation.outvars, results, strict=True))
    return [read(atom) for atom in program.outvars]


def _equation(writer: Writer, equation: Any, operands: list[Value]) -> list[Value]:
    name = equation.primitive.name
    if name == "optimization_barrier":
        return operands
    for rule in _RULES:
        results = rule(writer, name, operands, equation)
        if results is not None:
            return results
    results = write_control_flow(writer, name, operands, equation, _closed)
    if results is None:
        kinds = ", ".join(f"{kind_of(v.aval)}{list(v.aval.shape)}" for v in equation.invars)
        raise InputError(
            f"The model uses JAX's operation {name!r} (on {kinds}), which has no translation to C. Export the model "
            "without the part that uses it, or use export_step, which keeps the program as JAX compiled it."
        )
    return results
