"""Pictures of fits: record against simulation, residual, intervals, correlation. Each takes `ax` and returns it."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import ArrayLike

from fitting.result import FitResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def _axes(ax: "Axes | None") -> "Axes":
    if ax is not None:
        return ax
    from matplotlib import pyplot

    return pyplot.subplots(figsize=(7, 3.2), layout="constrained")[1]


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
    ax = _axes(ax)
    ax.plot(np.asarray(times), np.asarray(measured), color="0.55", lw=1.6, label="measured")
    ax.plot(np.asarray(times), np.asarray(simulated), color="C0", lw=0.8, label="simulated")
    ax.set_xlabel("time [s]")
    ax.set_ylabel(f"{label} [{unit}]")
    ax.legend(loc="upper right", ncols=2)
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
    ax = _axes(ax)
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

    Args:
        result: fit.
        truth: true values in SI by path.
        level: confidence.
        ax: axes to draw in; new ones if not given.
    """
    ax = _axes(ax)
    rows = np.arange(len(result.space))
    size = np.where(result.values == 0, 1.0, np.abs(result.values))
    low, high = 100 * (result.intervals(level).T - result.values) / size
    ax.hlines(rows, low, high, color="C0", lw=2.5, label=f"{100 * level:g} % interval")
    ax.plot(np.zeros_like(rows), rows, "o", color="C0", ms=4, label="estimate")
    if truth is not None:
        off = [100 * (truth[path] - v) / s for path, v, s in zip(result.space.paths, result.values, size, strict=True)]
        ax.plot(off, rows, "x", color="C3", ms=7, mew=1.8, label="true value")
    ax.set_yticks(rows, result.space.paths)
    ax.invert_yaxis()
    ax.margins(y=0.15)
    ax.set_xlabel("deviation from the estimate [%]")
    ax.legend(loc="best")
    return ax


def plot_correlation(result: FitResult, *, ax: "Axes | None" = None) -> "Axes":
    """Correlation of the estimates as a heat map.

    Args:
        result: fit.
        ax: axes to draw in; new ones if not given.
    """
    from matplotlib import pyplot

    if ax is None:
        side = 2.2 + 0.4 * len(result.space)
        ax = pyplot.subplots(figsize=(side + 1, side), layout="constrained")[1]
    image = ax.imshow(result.correlation, vmin=-1, vmax=1, cmap="RdBu_r")
    rows = np.arange(len(result.space))
    ax.set_xticks(rows, result.space.paths, rotation=45, ha="right")
    ax.set_yticks(rows, result.space.paths)
    ax.figure.colorbar(image, ax=ax, label="correlation [-]", shrink=0.8)
    return ax


def save_figure(figure: Any, path: Any) -> None:
    """Write a figure and forget it.

    Args:
        figure: matplotlib figure.
        path: file to write; its ending names the format.
    """
    from matplotlib import pyplot

    figure.savefig(path, dpi=150)
    pyplot.close(figure)
