"""Section: fits from many starts."""

from functools import partial

import numpy as np

from fitting.multistart import MultistartResult
from fitting.plots_multistart import plot_waterfall
from fitting.report.content import Cell, Figure, Section, Table, number_cells
from fitting.report.numbers import plain

_MOST = 6


def many_starts_section(many: MultistartResult) -> Section:
    """Where fits from many starts ended: the waterfall of their costs, and the minima found.

    Args:
        many: of `fitting.multistart.multistart`.
    """
    rows = []
    found = int(many.clusters.max(initial=-1)) + 1
    for cluster in range(min(found, _MOST)):
        members = np.flatnonzero(many.clusters == cluster)
        lowest = members[np.argmin(many.costs[members])]
        numbers = (str(members.size), plain(float(many.costs[lowest]), 5))
        rows.append(
            (
                Cell(str(cluster + 1)),
                *number_cells(numbers),
                *number_cells(plain(float(x)) for x in many.values[lowest]),
            )
        )
    head = ("Minimum", "Starts", "Cost [-]", *(p.label for p in many.space.parameters))
    tables = (Table(head, tuple(rows), "Minima found, the best first"),) if rows else ()
    remarks = [many.message] + ([f"Only the best {_MOST} of {found} minima are listed."] if found > _MOST else [])
    figure = Figure(
        partial(_draw, many),
        f"Costs of {len(many.costs)} fits from different starts in rising order",
        "Costs above the best, in rising order. A long flat step at the left says that the best minimum is found "
        "reliably; starts that did not converge are hollow.",
        wide=True,
        height=2.6,
    )
    return Section("Many starts", figures=(figure,), tables=tables, remarks=tuple(remarks))


def _draw(many: MultistartResult, axes: np.ndarray) -> None:
    ax = plot_waterfall(many, ax=axes[0])
    low, high = ax.get_ylim()
    if low > 0 and high < 10 * low:
        # Costs that differ by rounding alone are one step, not a slope.
        ax.set_ylim(low / 5, 5 * high)
