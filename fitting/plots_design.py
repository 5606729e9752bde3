"""Pictures of designs: trade-off curves."""

from typing import TYPE_CHECKING

import numpy as np

from fitting.solvers.stop import CONVERGED
from twin._axes import axes_or_new
from twin._checks import InputError

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

# Unit shown, and SI units in it.
_SHOWN = {"error [m]": ("static error [µm]", 1e6), "energy [J]": ("energy per cycle [J]", 1.0)}
_SHOWN["time [s]"] = ("response time [ms]", 1e3)


def plot_trade_off(
    table: "pd.DataFrame",
    x: str = "time [s]",
    y: str = "energy [J]",
    *,
    colour: str | None = "error [m]",
    ax: "Axes | None" = None,
) -> "Axes":
    """A trade-off curve: two measures of every design against each other, the third as colour.

    Designs that did not converge are crosses, dominated ones are hollow; the error is shown by its magnitude.

    Args:
        table: of `trade_off`.
        x: column on the horizontal axis.
        y: column on the vertical axis.
        colour: column that colours the points; None for none.
        ax: axes to draw in; new ones if not given.

    Returns:
        The axes.

    Raises:
        InputError: a column that the table does not have.
    """
    for column in (x, y, "status", "dominated", *([colour] if colour else [])):
        if column not in table.columns:
            raise InputError(f"The table has no column {column!r}; it has {', '.join(map(str, table.columns))}.")
    ax = axes_or_new(ax, (5.6, 3.8))
    horizontal, vertical = _shown(table, x), _shown(table, y)
    good = np.isin(table["status"].to_numpy(dtype=str), CONVERGED)
    dominated = table["dominated"].to_numpy(dtype=bool)
    best, rest = good & ~dominated, good & dominated
    order = np.argsort(horizontal[best])
    ax.plot(horizontal[best][order], vertical[best][order], color="0.6", linewidth=1, zorder=1)
    shade = _shown(table, colour) if colour else None
    seen = good if good.any() else np.full(good.shape, True)
    options = {} if shade is None else {"c": shade[best], "vmin": shade[seen].min(), "vmax": shade[seen].max()}
    points = ax.scatter(horizontal[best], vertical[best], s=36, zorder=2, label="best compromises", **options)
    if rest.any():
        ax.scatter(horizontal[rest], vertical[rest], s=36, facecolors="none", edgecolors="0.4", label="dominated")
    if (~good).any():
        ax.scatter(horizontal[~good], vertical[~good], marker="x", color="tab:red", label="not converged")
    if rest.any() or (~good).any():
        ax.legend()
    if shade is not None:
        ax.figure.colorbar(points, ax=ax, label=_SHOWN.get(str(colour), (str(colour), 1.0))[0])
    ax.set_xlabel(_SHOWN.get(x, (x, 1.0))[0])
    ax.set_ylabel(_SHOWN.get(y, (y, 1.0))[0])
    return ax


def _shown(table: "pd.DataFrame", column: str) -> np.ndarray:
    values = _SHOWN.get(column, (column, 1.0))[1] * table[column].to_numpy(dtype=float)
    return np.abs(values) if column == "error [m]" else values
