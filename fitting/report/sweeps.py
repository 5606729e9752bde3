"""Section: what-if sweeps."""

from functools import partial

import numpy as np

from fitting.report.content import Cell, Figure, Section, Table, number_cells
from fitting.report.numbers import given, plain
from twin.plots import plot_sweep
from twin.sweep_result import Sweep

_MOST_ROWS = 60


def sweep_section(sweep: Sweep, *, title: str = "Sweep") -> Section:
    """Results over one parameter as lines or over two as maps, and the numbers as a table.

    Args:
        sweep: of `twin.sweep.sweep`.
        title: title of the section.
    """
    drawable = (sweep.grid and len(sweep.parameters) <= 2) or len(sweep.parameters) == 1
    single = [name for name, values in sweep.results.items() if values.shape == sweep.shape]
    over = " and ".join(p.path for p in sweep.parameters)
    figures = [
        Figure(
            partial(_draw, sweep, name),
            f"{name} over {over}",
            f"{sweep.label(name)} over {over}.",
            height=2.6,
        )
        for name in single
        if drawable
    ]
    table = sweep.to_dataframe()
    rows = tuple(
        (*number_cells(plain(float(x), 5) for x in row[:-1]), Cell(str(row[-1])))
        for row in table.head(_MOST_ROWS).itertuples(index=False)
    )
    now = [
        f"{p.path} is {given(value)} {p.unit}".strip() for p, value in zip(sweep.parameters, sweep.present, strict=True)
    ]
    remarks = [f"At present {', '.join(now)}."]
    lost = int(np.count_nonzero(sweep.failed))
    if lost:
        remarks.append(f"{lost} of {sweep.failed.size} points have a result that is NaN; they are crossed out.")
    if len(table) > _MOST_ROWS:
        remarks.append(f"The first {_MOST_ROWS} of {len(table)} points are listed.")
    return Section(
        title,
        figures=tuple(figures),
        tables=(Table(tuple(str(name) for name in table.columns), rows, f"{over}: {len(table)} points", folded=True),),
        remarks=tuple(remarks),
    )


def _draw(sweep: Sweep, name: str, axes: np.ndarray) -> None:
    plot_sweep(sweep, name, ax=axes[0])
