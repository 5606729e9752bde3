"""Section: which estimates hang together."""

import numpy as np

from fitting.report.content import Cell, Section, Table
from fitting.result import FitResult

CLOSE = 0.9
"""Correlation from which a pair is named."""


def correlation_section(result: FitResult) -> Section:
    """Correlation of the estimates as a map; pairs above 0.9 are named.

    Args:
        result: the fit.
    """
    paths, correlation = result.space.paths, np.asarray(result.correlation)
    rows = tuple(
        (Cell(path, "name"), *(_cell(float(value)) for value in row))
        for path, row in zip(paths, correlation, strict=True)
    )
    pairs = close_pairs(result)
    remarks = [f"{a} and {b}: {_signed(value)}." for a, b, value in pairs] or [
        f"No two estimates are correlated by more than {CLOSE:g}."
    ]
    return Section(
        "Correlation of the estimates",
        text="Estimates that are closely correlated trade places: the data know their combination better than either.",
        tables=(Table(("", *paths), rows, "Correlation [-]", map=True),),
        remarks=tuple(remarks),
    )


def close_pairs(result: FitResult) -> list[tuple[str, str, float]]:
    """Pairs of estimates with a correlation above 0.9 in size, the closest first.

    Args:
        result: the fit.
    """
    correlation, paths = np.asarray(result.correlation), result.space.paths
    pairs = [
        (paths[i], paths[j], float(correlation[i, j]))
        for i in range(len(paths))
        for j in range(i + 1, len(paths))
        if abs(correlation[i, j]) > CLOSE
    ]
    return sorted(pairs, key=lambda pair: -abs(pair[2]))


def _cell(value: float) -> Cell:
    return Cell("×") if not np.isfinite(value) else Cell(_signed(value), tint=float(np.clip(value, -1, 1)))


def _signed(value: float) -> str:
    return f"{round(value, 2) + 0.0:.2f}".replace("-", "−")
