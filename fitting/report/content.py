"""What a report is made of: sections with texts, figures and tables. All texts are plain: the page escapes them."""

import dataclasses
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from twin._checks import InputError


class Bar(NamedTuple):
    """A small picture in a cell: where a value lies within its bounds. All places are shares of the way, 0 to 1."""

    at: float
    """Place of the value."""
    low: float
    """Place of the lower end of its interval."""
    high: float
    """Place of the upper end of its interval."""
    words: str
    """The same in words."""


class Cell(NamedTuple):
    """One cell of a table."""

    text: str
    """What it says."""
    kind: str = "text"
    """"text", "unit", "number" (to the right), "name" (of a parameter or channel), "good" or "bad" (marked)."""
    tint: float | None = None
    """Share of colour behind it: from -1 (one colour) to 1 (the other); none if not given."""
    bar: Bar | None = None
    """A small picture, in place of the text."""


def number_cells(texts: Iterable[str]) -> tuple[Cell, ...]:
    """Cells of numbers.

    Args:
        texts: the numbers as they are written.
    """
    return tuple(Cell(text, "number") for text in texts)


@dataclasses.dataclass(frozen=True)
class Table:
    """A table, which scrolls where the page is narrow."""

    head: tuple[str, ...]
    """Heads of the columns, with units."""
    rows: tuple[tuple[Cell, ...], ...]
    """Cells, row by row."""
    caption: str = ""
    """What the table shows."""
    folded: bool = False
    """Whether it is shown on demand, below the pictures."""
    map: bool = False
    """Whether it is a map of tinted cells, whose columns are narrow and whose heads stand upright."""

    def __post_init__(self):
        for row in self.rows:
            if len(row) != len(self.head):
                raise InputError(
                    f"A row of the table {self.caption!r} has {len(row)} cells, but there are {len(self.head)} heads. "
                    "Give one cell for each column."
                )


@dataclasses.dataclass(frozen=True)
class Figure:
    """A picture, drawn when the page is made: once for wide and once for narrow screens if it is wide."""

    draw: Callable[[Any], object]
    """Draws into an array of matplotlib Axes (panels,), which lie one below the other and share their abscissa."""
    alt: str
    """What is to be seen, for those who cannot see it."""
    caption: str = ""
    """Text below it."""
    panels: int = 1
    """Number of panels."""
    wide: bool = False
    """Whether it takes the whole width of the page, rather than half of it."""
    height: float = 2.4
    """Height of one panel [inch]."""

    def __post_init__(self):
        if not self.alt.strip():
            raise InputError("A figure needs an alt text. Say in one sentence what is to be seen.")


class Folded(NamedTuple):
    """A long text that is shown on demand, as it is."""

    title: str
    """Its name."""
    text: str
    """The text."""


@dataclasses.dataclass(frozen=True)
class Section:
    """A section of a report."""

    title: str
    """Its title."""
    text: str = ""
    """What it is about; an empty line begins a new paragraph."""
    figures: tuple[Figure, ...] = ()
    """Pictures."""
    tables: tuple[Table, ...] = ()
    """Tables."""
    remarks: tuple[str, ...] = ()
    """What a reader should know, one sentence or two each."""
    folded: tuple[Folded, ...] = ()
    """Long texts that are shown on demand."""


@dataclasses.dataclass(frozen=True)
class Report:
    """A report of one run."""

    title: str
    """Its title."""
    asked: Section
    """What was asked."""
    warnings: tuple[str, ...] = ()
    """What a reader has to know before all else, with the cure."""
    sections: tuple[Section, ...] = ()
    """The sections."""
    facts: tuple[tuple[str, str], ...] = ()
    """What came out in a few words: pairs of name and value."""
    stamp: str = ""
    """When it was made, in words; nothing else in the page depends on the time."""
