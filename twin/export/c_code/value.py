"""Values of a program in C: a scalar variable, or an array in row-major order."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from twin._checks import InputError

_TYPES = {"float64": "double", "bool": "bool"} | {
    f"{sign}int{n}": f"{sign}int{n}_t" for sign in ("", "u") for n in (32, 64)
}
_TYPES |= {f"{sign}int{n}": f"{sign}int{n}_t" for sign in ("", "u") for n in (8, 16)}


@dataclass(frozen=True)
class Value:
    """A value of the program, or a constant."""

    name: str
    """Name of the variable; of a constant scalar its literal."""
    shape: tuple[int, ...]
    """Shape of the array; the C variable is a scalar where it holds one number."""
    kind: str
    """NumPy's name of the type of its numbers: "float64", "int64", "bool", ..."""
    pointer: bool = False
    """Whether one number lies in memory behind a pointer, as the arguments of a function do."""

    @property
    def size(self) -> int:
        """Count of numbers."""
        return math.prod(self.shape)

    @property
    def c_type(self) -> str:
        """Type of its numbers in C."""
        return c_type(self.kind)

    def at(self, index: str) -> str:
        """One number, in C.

        Args:
            index: position in row-major order, in C; of no matter where there is only one number.
        """
        if self.size == 1:
            return f"{self.name}[0]" if self.pointer else self.name
        return f"{self.name}[{index}]"


def c_type(kind: str) -> str:
    """Type of a number in C.

    Args:
        kind: NumPy's name of the type.

    Raises:
        InputError: complex numbers, single precision, keys of random numbers.
    """
    if kind not in _TYPES:
        raise InputError(
            f"The model computes with numbers of type {kind}, which the translation to C does not know; it knows "
            f"{', '.join(_TYPES)}. Leave that part out of what is exported."
        )
    return _TYPES[kind]


def literal(number: Any, kind: str) -> str:
    """A number as it stands in C; a double to its last digit.

    Args:
        number: the number.
        kind: NumPy's name of its type.
    """
    if kind == "bool":
        return "true" if bool(number) else "false"
    if kind != "float64":
        whole = int(number)
        if kind.startswith("u"):
            return f"UINT64_C({whole})" if kind == "uint64" else f"{whole}u"
        # The least number has no literal of its own in C.
        least = whole == -(2**63)
        return "INT64_MIN" if least else (f"INT64_C({whole})" if kind == "int64" else f"({whole})")
    value = float(number)
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return "INFINITY" if value > 0 else "(-INFINITY)"
    return repr(value) if math.copysign(1.0, value) > 0 else f"({value!r})"


def kind_of(aval: Any) -> str:
    """NumPy's name of the type of a traced value.

    Args:
        aval: what JAX knows of it.
    """
    return np.dtype(aval.dtype).name if not str(aval.dtype).startswith("key") else str(aval.dtype)
