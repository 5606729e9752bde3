"""Operations on each number by itself, as formulas in C."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from twin.export.c_code.value import Value, c_type, kind_of
from twin.export.c_code.writer import Writer

# {0}, {1}, ... are the operands. Names beginning with dt_ are in arithmetic.h.
_FLOATS = {
    "abs": "fabs({0})",
    "acos": "acos({0})",
    "acosh": "acosh({0})",
    "asin": "asin({0})",
    "asinh": "asinh({0})",
    "atan": "atan({0})",
    "atan2": "atan2({0}, {1})",
    "atanh": "atanh({0})",
    "cbrt": "cbrt({0})",
    "ceil": "ceil({0})",
    "clamp": "dt_min(dt_max({1}, {0}), {2})",
    "cos": "cos({0})",
    "cosh": "cosh({0})",
    "div": "{0} / {1}",
    "erf": "erf({0})",
    "erfc": "erfc({0})",
    "eq_to": "({0} == {1} || ({0} != {0} && {1} != {1}))",
    "exp": "exp({0})",
    "exp2": "exp2({0})",
    "expm1": "expm1({0})",
    "floor": "floor({0})",
    "is_finite": "(isfinite({0}) != 0)",
    "le_to": "({0} <= {1} || {1} != {1})",
    "lgamma": "lgamma({0})",
    "log": "log({0})",
    "log1p": "log1p({0})",
    "logistic": "1.0 / (1.0 + exp(-({0})))",
    "lt_to": "({0} < {1} || ({0} == {0} && {1} != {1}))",
    "max": "dt_max({0}, {1})",
    "min": "dt_min({0}, {1})",
    "nextafter": "nextafter({0}, {1})",
    "pow": "pow({0}, (double)({1}))",
    "rem": "fmod({0}, {1})",
    "rsqrt": "1.0 / sqrt({0})",
    "sign": "dt_sign({0})",
    "sin": "sin({0})",
    "sinh": "sinh({0})",
    "sqrt": "sqrt({0})",
    "tan": "tan({0})",
    "tanh": "tanh({0})",
}
_WHOLE = {
    "abs": "({0} < 0 ? -({0}) : {0})",
    "clamp": "({1} < {0} ? {0} : {1} > {2} ? {2} : {1})",
    "div": "({1} == 0 ? -1 : {0} / {1})",
    "max": "({0} > {1} ? {0} : {1})",
    "min": "({0} < {1} ? {0} : {1})",
    "rem": "({1} == 0 ? {0} : {0} % {1})",
    "sign": "(({0} > 0) - ({0} < 0))",
    "shift_left": "(({1}) < 8 * sizeof({0}) ? ({0}) << ({1}) : 0)",
    "shift_right_arithmetic": "({0}) >> ({1})",
}
_BOTH = {
    "add": "{0} + {1}",
    "add_any": "{0} + {1}",
    "and": "{0} & {1}",
    "copy": "{0}",
    "copy_p": "{0}",
    "eq": "{0} == {1}",
    "ge": "{0} >= {1}",
    "gt": "{0} > {1}",
    "le": "{0} <= {1}",
    "lt": "{0} < {1}",
    "mul": "{0} * {1}",
    "ne": "{0} != {1}",
    "neg": "-({0})",
    "or": "{0} | {1}",
    "square": "({0}) * ({0})",
    "stop_gradient": "{0}",
    "sub": "{0} - {1}",
    "xor": "{0} ^ {1}",
}


def _not(kind: str, operands: list[Value], params: Any) -> str:
    del operands, params
    return "!({0})" if kind == "bool" else "~({0})"


def _round(kind: str, operands: list[Value], params: Any) -> str:
    del kind, operands
    # Halves away from zero, or to the even neighbour.
    return "round({0})" if int(params["rounding_method"]) == 0 else "nearbyint({0})"


def _integer_pow(kind: str, operands: list[Value], params: Any) -> str:
    del operands
    power = int(params["y"])
    if power == 2:
        return "({0}) * ({0})"
    return f"dt_integer_pow({{0}}, {power})" if kind == "float64" else " * ".join(["({0})"] * power)


def _select(kind: str, operands: list[Value], params: Any) -> str:
    del kind, params
    if operands[0].kind == "bool":
        return "({0} ? {2} : {1})"
    last = len(operands) - 1
    return "".join(f"({{0}} <= {i - 1} ? {{{i}}} : " for i in range(1, last)) + f"{{{last}}}" + ")" * (last - 1)


def _convert(kind: str, operands: list[Value], params: Any) -> str:
    if kind == "bool":
        return "(({0}) != 0)"
    if operands[0].kind == "float64" and kind != "float64":
        return f"({c_type(kind)})dt_whole({{0}})"
    return f"({c_type(kind)})({{0}})"


def _bits(kind: str, operands: list[Value], params: Any) -> str:
    if kind == "float64":
        return "dt_from_bits((uint64_t)({0}))"
    return f"({c_type(kind)})dt_bits({{0}})" if operands[0].kind == "float64" else f"({c_type(kind)})({{0}})"


def _shift_right(kind: str, operands: list[Value], params: Any) -> str:
    unsigned = kind if kind.startswith("u") else f"u{kind}"
    return f"(({{1}}) < 8 * sizeof({{0}}) ? ({c_type(kind)})(({c_type(unsigned)})({{0}}) >> ({{1}})) : 0)"


_BY_RULE: dict[str, Callable[[str, list[Value], Any], str]] = {
    "not": _not,
    "round": _round,
    "integer_pow": _integer_pow,
    "select_n": _select,
    "convert_element_type": _convert,
    "bitcast_convert_type": _bits,
    "shift_right_logical": _shift_right,
}


def formula(name: str, kind: str, operands: list[Value], params: Any) -> str | None:
    """The formula of an operation, None where it does not work on each number by itself.

    Args:
        name: JAX's name of the operation.
        kind: type of the result.
        operands: what it is applied to.
        params: its settings.
    """
    if name in _BY_RULE:
        return _BY_RULE[name](kind, operands, params)
    if name == "div" and kind.startswith("u"):
        return "({1} == 0 ? ({0} | ~({0})) : {0} / {1})"
    own = _FLOATS if operands and operands[0].kind == "float64" else _WHOLE
    return own.get(name) or _BOTH.get(name)


def write_elementwise(writer: Writer, name: str, operands: list[Value], equation: Any) -> list[Value] | None:
    """Write an operation on each number by itself; None where it is not one.

    Args:
        writer: text so far.
        name: JAX's name of the operation.
        operands: what it is applied to.
        equation: JAX's equation, for its settings and its result.
    """
    aval = equation.outvars[0].aval
    kind = kind_of(aval)
    text = formula(name, kind, operands, equation.params)
    if text is None:
        return None
    if name in ("copy", "copy_p", "stop_gradient") or (name == "convert_element_type" and operands[0].kind == kind):
        return [operands[0]]
    return [
        writer.elements(aval.shape, kind, lambda i: text.format(*(_at(writer, o, aval.shape, i) for o in operands)))
    ]


def _at(writer: Writer, operand: Value, shape: tuple[int, ...], index: str) -> str:
    """One number of an operand, whose axes of length one serve for every number along them."""
    if operand.size in (1, math.prod(shape)):
        return operand.at(index)
    positions = np.arange(operand.size).reshape(operand.shape)
    return operand.at(writer.index(np.broadcast_to(positions, shape), index))
