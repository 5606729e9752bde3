"""The sections of the benchmarks: one module each, found by its name, with a function `section(options)`.

A new section is a new module here; no other file changes.
"""

import importlib
import pkgutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.benchmarks.summary import SummaryRow


@dataclass(frozen=True)
class Options:
    """What a run was asked for."""

    out: Path
    """Folder for pictures."""
    rounds: int = 2
    """Turns of timing."""
    ticks: int = 2000
    """Length of the stretch of the EMPS record on which all entrants run."""
    starts: int = 1000
    """Starts of the nonlinear programmes."""
    short: bool = False
    """Leave out what takes long."""
    earlier: Any = None
    """What another run wrote in `benchmarks.json`, to compare with; None for nothing."""


@dataclass(frozen=True)
class Section:
    """What a section leaves behind."""

    text: str
    """Markdown, from its heading on."""
    results: Any
    """The same as plain numbers and names."""
    summary: list[SummaryRow]
    """Its rows of the summary."""


def names() -> list[str]:
    """All sections."""
    return sorted(module.name for module in pkgutil.iter_modules(__path__))


def run(name: str, options: Options) -> Section:
    """Run one section.

    Args:
        name: one of `names`.
        options: what was asked for.
    """
    return importlib.import_module(f"{__name__}.{name}").section(options)
