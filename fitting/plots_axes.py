"""What the plots of this room share: legends, and the scales of parameters."""

from typing import TYPE_CHECKING

import numpy as np

from twin.parameters import Parameter

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def is_wide(parameter: Parameter, values: np.ndarray) -> bool:
    """Whether a parameter is on a log scale and its values span more than a decade.

    Args:
        parameter: the parameter.
        values: what is drawn of it, SI.
    """
    finite = values[np.isfinite(values)]
    return bool(parameter.scale == "log" and finite.size and 0 < 10 * finite.min() < finite.max())


def add_shared_legend(grid: np.ndarray, columns: int) -> None:
    """One legend for all panels of a figure, below them.

    Args:
        grid: panels that show the same things; the first one's labels are used.
        columns: columns of the legend; two at most under a single panel.
    """
    handles, labels = grid[0].get_legend_handles_labels()
    columns = columns if len(grid) > 1 else 2
    grid[0].figure.legend(handles, labels, loc="outside lower center", ncols=columns, fontsize="small")


def scale_axis(ax: "Axes", parameter: Parameter, values: np.ndarray) -> None:
    """A logarithmic abscissa for a parameter on a log scale whose values differ much; few ticks otherwise.

    Args:
        ax: axes whose abscissa is the parameter.
        parameter: the parameter.
        values: what is drawn of it, SI.
    """
    from matplotlib.ticker import MaxNLocator

    if is_wide(parameter, values):
        ax.set_xscale("log")
    else:
        ax.xaxis.set_major_locator(MaxNLocator(4))
