"""Writes lines of C: declares variables, opens and closes blocks, keeps tables of numbers."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from twin.export.c_code.value import Value, c_type, literal

_WIDTH = 110


class Writer:
    """Text of one C function as it grows."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.tables: dict[str, str] = {}
        self._depth = 1
        self._count = 0

    def name(self, stem: str = "v") -> str:
        """A name that was not given before.

        Args:
            stem: what it begins with.
        """
        self._count += 1
        return f"{stem}{self._count}"

    def line(self, text: str) -> None:
        """One line, indented.

        Args:
            text: the line.
        """
        self.lines.append("    " * self._depth + text)

    @contextmanager
    def block(self, head: str) -> Iterator[None]:
        """A block in braces.

        Args:
            head: what stands before the brace.
        """
        self.line(f"{head} {{" if head else "{")
        self._depth += 1
        yield
        self._depth -= 1
        self.line("}")

    def declare(self, shape: tuple[int, ...], kind: str) -> Value:
        """A new variable without a value.

        Args:
            shape: its shape.
            kind: NumPy's name of the type of its numbers.
        """
        value = Value(self.name(), shape, kind)
        self.line(
            f"{value.c_type} {value.name};"
            if value.size == 1
            else f"{value.c_type} {value.name}[{max(value.size, 1)}];"
        )
        return value

    def elements(self, shape: tuple[int, ...], kind: str, number: Callable[[str], str]) -> Value:
        """A new variable, each of its numbers given by a formula.

        Args:
            shape: its shape.
            kind: NumPy's name of the type of its numbers.
            number: from the position in row-major order, in C, to the number, in C.
        """
        if math.prod(shape) == 1:
            name = self.name()
            self.line(f"const {c_type(kind)} {name} = {number('0')};")
            return Value(name, shape, kind)
        value = self.declare(shape, kind)
        self.line(f"for (int i = 0; i < {value.size}; ++i) {value.name}[i] = {number('i')};")
        return value

    def store(self, target: Value, source: Value, offset: str = "") -> None:
        """Copy all numbers into a variable that exists.

        Args:
            target: what is written to.
            source: what is read.
            offset: position of the first number in the target, in C, where the target is larger.
        """
        if source.size == 1:
            self.line(f"{target.at(offset or '0')} = {source.at('0')};")
        else:
            at = f"{offset} + i" if offset else "i"
            self.line(f"for (int i = 0; i < {source.size}; ++i) {target.name}[{at}] = {source.name}[i];")

    def index(self, positions: np.ndarray, counter: str = "i") -> str:
        """Position to read at, as a function of a counter: a formula where there is one, else a table.

        Args:
            positions: position for each value of the counter.
            counter: the counter, in C.
        """
        flat = np.ravel(positions).astype(np.int64)
        if flat.size == 0:
            return "0"
        step = int(flat[1] - flat[0]) if flat.size > 1 else 0
        if np.array_equal(flat, flat[0] + step * np.arange(flat.size)):
            scaled = "" if step == 0 else counter if step == 1 else f"{step} * ({counter})"
            start = int(flat[0])
            return scaled if scaled and start == 0 else f"{start} + {scaled}" if scaled else str(start)
        return f"{self.table(flat, 'int32')}[{counter}]"

    def table(self, numbers: np.ndarray, kind: str) -> str:
        """Name of a table of constants.

        Args:
            numbers: the numbers.
            kind: NumPy's name of their type.
        """
        words = [literal(number, kind) for number in np.ravel(numbers).tolist()]
        rows, row = [], ""
        for word in words:
            if len(row) + len(word) > _WIDTH:
                rows, row = [*rows, row], ""
            row += f"{word}, "
        text = f"{c_type(kind)} NAME[{len(words)}] = {{\n    " + "\n    ".join([*rows, row]).rstrip(", ") + "\n};"
        if text not in self.tables:
            self.tables[text] = self.name("table")
        return self.tables[text]

    def constant(self, array: np.ndarray) -> Value:
        """A constant of the program.

        Args:
            array: its numbers.
        """
        kind = array.dtype.name
        c_type(kind)
        if array.size == 1:
            return Value(literal(array.reshape(-1)[0], kind), array.shape, kind)
        return Value(self.table(array, kind), array.shape, kind)
