"""Pictures of a fit: record against simulation, residual, intervals, correlation. Each takes `ax` and returns it."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import ArrayLike

from fitting.result import FitResult
from twin._axes import axes_or_new

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Ratio of the widest relative interval to the narrowest from which a linear scale would hide the narrow ones.
_MUCH = 20.0


def plot_comparison(
    times: ArrayLike, measured: ArrayLike, simulated: ArrayLike, *, label: str, unit: str, ax: "Axes | None" = None
) -> "Axes":
    """Measured and simulated samples over time.

    Args:
        times: times (samples,) [s].
        measured: samples (samples,).
        simulated: samples (samples,), same unit.
        label: what was measured.
        unit: its unit.
        ax: axes to draw in; new ones if not given.
    """
    ax = axes_or_new(ax)
    ax.plot(np.asarray(times), np.asarray(measured), color="0.55", lw=1.6, label="measured")
    ax.plot(np.asarray(times), np.asarray(simulated), color="C0", lw=0.8, label="simulated")
    ax.set_xlabel("time [s]")
    ax.set_ylabel(f"{label} [{unit}]")
    # Above the axes, where it covers nothing.
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, frameon=False, fontsize="small", borderaxespad=0.2)
    ax.margins(x=0)
    return ax


def plot_residual(
    x: ArrayLike, residual: Mapping[str, ArrayLike], *, xlabel: str, ylabel: str, ax: "Axes | None" = None
) -> "Axes":
    """Residuals of one or more models against time, position or speed: what is missing shows as a shape.

    Args:
        x: abscissa (samples,).
        residual: measured minus simulated (samples,) by the model's name.
        xlabel: name and unit of the abscissa.
        ylabel: name and unit of the residual.
        ax: axes to draw in; new ones if not given.
    """
    ax = axes_or_new(ax)
    for i, (name, values) in enumerate(residual.items()):
        ax.plot(np.asarray(x), np.asarray(values), ".", ms=1.0, color=f"C{i}", alpha=0.6, label=name, rasterized=True)
    ax.axhline(0, color="0.3", lw=0.6)
    ax.set_xlabel(xlabel)
    ax.set_ylabel(ylabel)
    ax.legend(loc="upper right", markerscale=8)
    ax.margins(x=0)
    return ax


def plot_intervals(
    result: FitResult, *, truth: Mapping[str, float] | None = None, level: float = 0.95, ax: "Axes | None" = None
) -> "Axes":
    """Confidence intervals relative to the estimates, and the true values where they are known.

    Intervals reach over decades, and a parameter near zero, such as an offset, has one of many times its estimate: the
    abscissa is linear near zero and logarithmic beyond, where they differ much. A parameter without an interval is
    marked, and its name says why: it sits on a bound (a triangle that points against the bound), or the data do not
    determine it (a hollow circle). Estimates of zero have no relative deviation; theirs is in the parameter's own unit,
    a hundredth of which is one per cent.

    Args:
        result: fit.
        truth: true values in SI by path; parameters that it leaves out get no mark.
        level: confidence.
        ax: axes to draw in; new ones if not given.
    """
    count = len(result.space)
    ax = axes_or_new(ax, (7.0, 1.4 + 0.3 * max(count, 6)))
    rows = np.arange(count)
    size = np.where(result.values == 0, 1.0, np.abs(result.values))
    low, high = 100 * (result.intervals(level).T - result.values) / size
    known, held = np.isfinite(low) & np.isfinite(high), np.asarray(result.active)
    ax.hlines(rows[known], low[known], high[known], color="C0", lw=2.5, label=f"{100 * level:g} % interval")
    ax.plot(np.zeros(known.sum()), rows[known], "o", color="C0", ms=4, label="estimate")
    lower = np.asarray([np.isclose(v, p.lower) for v, p in zip(result.values, result.space.parameters, strict=True)])
    for mask, marker, label in (
        (held & lower, "<", "at the lower bound"),
        (held & ~lower, ">", "at the upper bound"),
        (~held & ~known, "o", "no interval"),
    ):
        if mask.any():
            ax.plot(np.zeros(mask.sum()), rows[mask], marker, color="C1", mfc="none", mew=1.6, ms=7, label=label)
    if truth is not None:
        named = [i for i, path in enumerate(result.space.paths) if path in truth]
        off = [100 * (truth[result.space.paths[i]] - result.values[i]) / size[i] for i in named]
        ax.plot(off, named, "x", color="C3", ms=7, mew=1.8, label="true value")
    ax.axvline(0, color="0.8", lw=0.8, zorder=0)
    ax.set_yticks(rows, [_name_and_remark(result, i, bool(lower[i])) for i in range(count)])
    ax.set_ylim(count - 0.5, -0.5)
    ax.margins(x=0.08)
    reach = np.maximum(np.abs(low), np.abs(high))[known]
    reach = reach[reach > 0]
    if reach.size and reach.max() > _MUCH * reach.min():
        ax.set_xscale("symlog", linthresh=float(reach.min()))
        _few_ticks(ax)
    ax.set_xlabel("deviation from the estimate [%]")
    ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize="small")
    return ax


def plot_correlation(result: FitResult, *, ax: "Axes | None" = None) -> "Axes":
    """Correlation of the estimates as a heat map with its numbers; a cross where there is none to give.

    Args:
        result: fit.
        ax: axes to draw in; new ones if not given.
    """
    count = len(result.space)
    words = 0.08 * max(len(path) for path in result.space.paths)
    ax = axes_or_new(ax, (1.8 + words + 0.55 * count, 0.6 + 0.75 * words + 0.55 * count))
    correlation = np.asarray(result.correlation)
    image = ax.imshow(correlation, vmin=-1, vmax=1, cmap="RdBu_r")
    rows = np.arange(count)
    small = "small" if count <= 10 else 6
    for i in range(count):
        for j in range(count):
            value = correlation[i, j]
            text = f"{value:.2f}".replace("-", "−") if np.isfinite(value) else "×"
            ax.text(j, i, text, ha="center", va="center", fontsize=small, color="w" if abs(value) > 0.6 else "k")
    ax.set_xticks(rows, result.space.paths, rotation=45, ha="right", rotation_mode="anchor")
    ax.set_yticks(rows, result.space.paths)
    ax.set_facecolor("0.9")
    ax.figure.colorbar(image, ax=ax, label="correlation [-]", shrink=0.8)
    return ax


def _few_ticks(ax: "Axes") -> None:
    """Powers of ten in plain numbers, on an axis that is linear near zero."""
    from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator

    threshold = ax.xaxis.get_transform().linthresh  # pyright: ignore[reportAttributeAccessIssue]
    farthest = max(abs(one) for one in ax.get_xlim())
    first, last = int(np.ceil(np.log10(threshold))), int(np.floor(np.log10(farthest)))
    powers = 10.0 ** np.arange(first, last + 1)[:: max(1, (last - first + 1) // 3)]
    ax.set_xticks([*(-powers[::-1]), 0.0, *powers])
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_minor_formatter(NullFormatter())


def _name_and_remark(result: FitResult, i: int, lower: bool) -> str:
    path = result.space.paths[i]
    if result.active[i]:
        return f"{path}\n(at its {'lower' if lower else 'upper'} bound)"
    if result.unseen[i]:
        return f"{path}\n(not determined)"
    return path


def save_figure(figure: Any, path: Any) -> None:
    """Write a figure and forget it.

    Args:
        figure: matplotlib figure.
        path: file to write; its ending names the format.
    """
    from matplotlib import pyplot

    figure.savefig(path, dpi=150)
    pyplot.close(figure)
