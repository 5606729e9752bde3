"""Axes given by the caller, or new ones: what every picture begins with."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from twin._checks import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def axes_or_new(ax: "Axes | None", size: tuple[float, float] = (7.0, 3.2)) -> "Axes":
    """The axes given, or those of a new figure.

    Args:
        ax: axes, or None.
        size: width and height of a new figure [inch].
    """
    if ax is not None:
        return ax
    from matplotlib import pyplot

    return pyplot.subplots(figsize=size, layout="constrained")[1]


def grid_or_new(
    axes: "Sequence[Axes] | np.ndarray | None", count: int, *, columns: int = 3, panel: tuple[float, float] = (3.4, 2.6)
) -> "np.ndarray":
    """As many axes as asked for: those given, or a grid of a new figure.

    Args:
        axes: axes, or None.
        count: panels needed.
        columns: most panels in a row.
        panel: width and height of one panel of several [inch].

    Returns:
        Axes (count,).

    Raises:
        InputError: another number of axes than panels.
    """
    if axes is not None:
        given = np.asarray(axes, dtype=object).ravel()
        if given.size != count:
            raise InputError(f"axes holds {given.size} axes, but {count} are drawn. Give as many, or none.")
        return given
    from matplotlib import pyplot

    wide = min(count, columns)
    high = -(-count // wide)
    size = (wide * panel[0], high * panel[1]) if count > 1 else (5.0, 3.6)
    grid = pyplot.subplots(high, wide, figsize=size, layout="constrained", squeeze=False)[1].ravel()
    for unused in grid[count:]:
        unused.remove()
    return grid[:count]
