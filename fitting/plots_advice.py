"""Pictures of identified machines: how well each parameter is known, and what a further measurement would bring."""

from typing import TYPE_CHECKING

import numpy as np

from fitting.identification.machine_advice import MeasurementAdvice
from twin._axes import axes_or_new
from twin._checks import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_WEAK, _KNOWN = "tab:orange", "0.75"
_MARKS = ("o", "s", "D", "^", "v", "P", "X", "*")


def plot_advice(advice: MeasurementAdvice, ax: "Axes | None" = None, *, most: int = 40) -> "Axes":
    """Relative standard errors by parameter as bars, the limit as a line, and what the best measurement would bring.

    Bars of parameters known too weakly are orange; the mark in such a bar is the standard error after the measurement
    that helps this parameter most. A parameter that is not seen has a hatched bar over the whole width, one on a bound
    a star behind its name.

    Args:
        advice: of `helpful_measurements`.
        ax: axes to draw in; new ones, as high as there are parameters, if not given.
        most: number of parameters that are drawn, the least known first.

    Returns:
        The axes.

    Raises:
        InputError: most below one.
    """
    from matplotlib.patches import Patch

    if most < 1:
        raise InputError(f"most must be at least 1, but is {most}.")
    order = np.argsort(-advice.known, kind="stable")[:most]
    ax = axes_or_new(ax, (7.2, 1.3 + 0.2 * order.size))
    weak, best = set(advice.weak), advice.best
    seen = np.isfinite(advice.known)
    finite = [advice.known[seen], advice.predicted[np.isfinite(advice.predicted)], [advice.limit]]
    largest = float(np.max(np.concatenate([np.ravel(part) for part in finite])))
    smallest = float(np.min(np.concatenate([np.ravel(part) for part in finite])))
    low, high = 100 * smallest / 2, 100 * largest * 2
    for row, i in enumerate(order):
        known = 100 * advice.known[i] if seen[i] else high
        colour = _WEAK if advice.parameters[i] in weak else _KNOWN
        hatch = None if seen[i] else "//"
        ax.barh(row, known - low, left=low, height=0.7, color=colour, hatch=hatch, edgecolor="white", linewidth=0)
    drawn = {advice.parameters[i]: (row, i) for row, i in enumerate(order)}
    for k, name in enumerate(advice.candidates):
        rows = [drawn[path] for path in best if best[path] == name and path in drawn]
        if rows:
            after = [100 * advice.predicted[k, i] for _, i in rows]
            mark = _MARKS[k % len(_MARKS)]
            ax.plot(after, [row for row, _ in rows], mark, color="0.1", mec="white", ms=7, ls="", label=f"with {name}")
    ax.axvline(100 * advice.limit, color="tab:red", lw=1.2, label=f"limit {100 * advice.limit:g} %")
    ax.set_xscale("log")
    ax.set_xlim(low, high)
    ax.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    ax.set_yticks(range(order.size), [_label(advice, int(i)) for i in order], fontsize="small")
    ax.set_ylim(order.size - 0.4, -0.6)
    ax.set_xlabel("relative standard error [%]")
    shades = (("now, known too weakly", _WEAK), ("now", _KNOWN)) if weak else (("now", _KNOWN),)
    handles = [Patch(color=colour, label=label) for label, colour in shades]
    ax.legend(handles=handles + ax.get_legend_handles_labels()[0], fontsize="small", loc="lower right", framealpha=1.0)
    return ax


def _label(advice: MeasurementAdvice, i: int) -> str:
    short = advice.parameters[i].removeprefix("joints.")
    return f"{short} *" if advice.on_bound[i] else short
