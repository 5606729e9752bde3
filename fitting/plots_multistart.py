"""Pictures of many starts: how low they ended, and where."""

from typing import TYPE_CHECKING

import numpy as np

from fitting.multistart import MultistartResult
from twin._axes import axes_or_new

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_NAMED = 6
_OTHERS = "0.55"


def plot_waterfall(result: MultistartResult, *, ax: "Axes | None" = None) -> "Axes":
    """Costs of all starts in rising order, as the distance above the best: a long flat step says that the best minimum
    is found reliably.

    Starts that ended in one minimum share a colour. Starts that did not converge are hollow; those that failed have no
    cost, and are counted in the title.

    Args:
        result: of `multistart`.
        ax: axes to draw in; new ones if not given.
    """
    ax = axes_or_new(ax)
    finite = np.isfinite(result.costs)
    order = np.flatnonzero(finite)[np.argsort(result.costs[finite], kind="stable")]
    rank = {int(start): i + 1 for i, start in enumerate(order)}
    lowest = float(result.costs[order[0]]) if order.size else 0.0
    above = result.costs - lowest
    # Where the best cost is zero but for rounding, the next one tells the size.
    floor = 1e-6 * lowest or 1e-3 * float(np.min(above, where=above > 0, initial=np.inf))
    floor = floor if np.isfinite(floor) and floor > 0 else 1.0
    for label, members, style in _groups(result):
        ax.plot([rank[int(i)] for i in members], above[members] + floor, ls="none", label=label, **style)
    ax.set_yscale("log")
    ax.set_xlabel("start, in order of its cost")
    ax.set_ylabel(f"cost above the best [-],\ndrawn from {floor:.0e} up")
    failed = int(np.sum(~finite))
    ax.set_title(f"best cost {lowest:.5g}, {_counted(failed, len(finite))}" if order.size else "all starts failed")
    _finish(ax, order.size)
    return ax


def plot_parallel(result: MultistartResult, *, ax: "Axes | None" = None) -> "Axes":
    """Where the starts ended: one line for each, one row for each parameter, from its lower to its upper bound.

    A row in which all lines of a low cost meet is a parameter that is determined; one over which they spread is not.
    The best ends are drawn on top; colours are those of `plot_waterfall`.

    Args:
        result: of `multistart`.
        ax: axes to draw in; new ones if not given.
    """
    count = len(result.space)
    ax = axes_or_new(ax, (7.0, 1.6 + 0.5 * count))
    scaled = result.space.scaled_rows(result.values)
    lower, upper = np.asarray(result.space.lower), np.asarray(result.space.upper)
    low, high = _limits(scaled, lower, upper)
    place = (scaled - low) / np.where(high > low, high - low, 1.0)
    rows = np.arange(count)
    for depth, (label, members, style) in enumerate(_groups(result)):
        looks = {"color": style["color"], "marker": "o", "ms": 4, "mfc": style["mfc"], "zorder": 10 - min(depth, 7)}
        looks |= {"lw": 1.8 if depth == 0 else 0.9, "alpha": 1.0 if depth == 0 else 0.7}
        for number, i in enumerate(members[::-1]):
            ax.plot(place[i], rows, label=label if number == 0 else None, clip_on=False, **looks)
    names = []
    for p, a, b, below, above in zip(result.space.parameters, low, high, lower, upper, strict=True):
        ends = f"{float(p.from_scaled(a)):.4g} … {float(p.from_scaled(b)):.4g}"
        note = "" if np.isfinite(below) and np.isfinite(above) else ", as found"
        names.append(f"{p.label}\n{ends}{note}{', log' if p.scale == 'log' else ''}")
    ax.set_yticks(rows, names)
    ax.set_ylim(count - 0.6, -0.4)
    ax.set_xlim(0, 1)
    ax.grid(axis="y", color="0.85")
    ax.set_axisbelow(True)
    ax.set_xticks([0, 0.25, 0.5, 0.75, 1], ["lower", "¼", "½", "¾", "upper"])
    ax.set_xlabel("place between the bounds, on the parameter's scale [-]")
    failed = int(np.sum(~np.isfinite(result.costs)))
    ax.set_title(_counted(failed, len(result.costs)) if failed < len(result.costs) else "all starts failed")
    _finish(ax, len(result.costs) - failed, outside=True)
    return ax


def _groups(result: MultistartResult) -> list[tuple[str, np.ndarray, dict]]:
    """Label, members in order of cost, and style of each minimum; then those that did not converge."""
    groups = []
    found = int(result.clusters.max(initial=-1)) + 1
    size = {"marker": "o", "ms": 5}
    for cluster in range(min(found, _NAMED)):
        members = _sorted(result, result.clusters == cluster)
        label = f"minimum {cluster + 1} ({_plural(members.size)})"
        groups.append((label, members, {"color": f"C{cluster}", "mfc": f"C{cluster}", **size}))
    others = _sorted(result, result.clusters >= _NAMED)
    if others.size:
        label = f"{found - _NAMED} higher minima ({_plural(others.size)})"
        groups.append((label, others, {"color": _OTHERS, "mfc": _OTHERS, **size}))
    open_ones = _sorted(result, (result.clusters < 0) & np.isfinite(result.costs))
    if open_ones.size:
        groups.append(
            (f"not converged ({_plural(open_ones.size)})", open_ones, {"color": _OTHERS, "mfc": "none", **size})
        )
    return groups


def _sorted(result: MultistartResult, mask: np.ndarray) -> np.ndarray:
    members = np.flatnonzero(mask)
    return members[np.argsort(result.costs[members], kind="stable")]


def _limits(scaled: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The bounds, and where there are none the ends found."""
    some = np.where(np.isfinite(scaled), scaled, 0.0)
    least = np.min(some, axis=0, where=np.isfinite(scaled), initial=np.inf)
    most = np.max(some, axis=0, where=np.isfinite(scaled), initial=-np.inf)
    empty = ~np.isfinite(least)
    low = np.where(np.isfinite(lower), lower, np.where(empty, 0.0, least))
    return low, np.where(np.isfinite(upper), upper, np.where(empty, low + 1.0, most))


def _counted(failed: int, total: int) -> str:
    return f"{failed} of {total} starts failed" if failed else f"{total} starts, none failed"


def _plural(count: int) -> str:
    return f"{count} start" if count == 1 else f"{count} starts"


def _finish(ax: "Axes", drawn: int, *, outside: bool = False) -> None:
    if drawn == 0:
        ax.text(0.5, 0.5, "nothing to draw", transform=ax.transAxes, ha="center", color="0.4")
    elif outside:
        ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize="small")
    else:
        from matplotlib.ticker import MaxNLocator

        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
        ax.legend(loc="best", fontsize="small")
