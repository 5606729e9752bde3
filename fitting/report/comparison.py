"""Section: the fit against the measurement, over time."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from fitting.plots import plot_comparison
from fitting.report.compared import Compared
from fitting.report.content import Cell, Figure, Section, Table, number_cells
from fitting.report.numbers import percent, plain
from fitting.report.thinning import thinned, with_gaps


def comparison_section(series: Sequence[Compared]) -> Section:
    """Measured and simulated samples over each other, with the size of the error.

    Args:
        series: channels that were simulated.
    """
    head = ("Record", "Channel", "Unit", "Error, rms", "Error, largest", "Relative error", "Error / noise, rms")
    rows = []
    for one in series:
        weighted = one.weighted
        numbers = (
            plain(one.rms, 3),
            plain(float(np.max(np.abs(one.error))), 3),
            percent(one.relative),
            "–" if weighted is None else plain(float(np.sqrt(np.mean(weighted**2))), 3),
        )
        rows.append((Cell(one.record), Cell(one.channel, "name"), Cell(one.unit, "unit"), *number_cells(numbers)))
    figures = []
    for record in dict.fromkeys(one.record for one in series):
        members = [one for one in series if one.record == record]
        names = ", ".join(one.channel for one in members)
        figures.append(
            Figure(
                draw=partial(_draw, members),
                alt=f"Measured and simulated {names} over time, record {record}",
                caption=f"{record}: measured and simulated.",
                panels=len(members),
                wide=True,
                height=1.7,
            )
        )
    return Section(
        "Fit against measurement",
        text="Relative errors are those of a channel about its mean.",
        figures=tuple(figures),
        tables=(Table(head, tuple(rows), "Measured minus simulated"),),
    )


def _draw(members: list[Compared], axes: np.ndarray) -> None:
    for number, (ax, one) in enumerate(zip(axes, members, strict=True)):
        kept = thinned(ax, one.measured, one.simulated)
        columns = with_gaps(one.times, kept, one.measured, one.simulated)
        plot_comparison(*columns, label=one.channel, unit=one.unit, ax=ax)
        legend = ax.get_legend()
        if number and legend is not None:
            legend.remove()
        if number + 1 < len(members):
            ax.set_xlabel("")
