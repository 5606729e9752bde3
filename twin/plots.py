"""Pictures of sweeps: lines over one parameter, a map over two."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from twin._axes import axes_or_new, grid_or_new
from twin._checks import InputError
from twin.sweep_result import Sweep

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Values count as evenly spaced on a logarithmic scale if their ratios agree to this.
_EVEN = 1e-6


def plot_sweep(sweep: Sweep, result: str | None = None, *, ax: "Axes | None" = None) -> "Axes":
    """One result of a sweep: a line over one parameter, or a map with contours over two.

    The present value of a parameter is marked where it lies in the picture; points that are NaN are crossed out.

    Args:
        sweep: what to draw.
        result: name of the result; needed if there are several.
        ax: axes to draw in; new ones if not given.

    Returns:
        The axes.

    Raises:
        InputError: several results and none named, an unknown one, one that is an array at each point, more than two
            parameters.
    """
    if result is None:
        if len(sweep.results) > 1:
            raise InputError(
                f"The sweep has the results {', '.join(sweep.results)}. Name one, or use plot_sweep_panels."
            )
        (result,) = sweep.results
    values = sweep[result]
    if values.shape != sweep.shape:
        raise InputError(
            f"The result {result!r} is not one number at each point. Plot a part of to_xarray()[{result!r}]."
        )
    if not sweep.grid and len(sweep.parameters) > 1:
        raise InputError("A list of points has no axes to draw. Plot columns of to_dataframe() against each other.")
    if values.ndim > 2:
        raise InputError(
            f"The sweep is over {values.ndim} parameters, but a picture has two axes. Pick values of the others, as in "
            f"to_xarray()[{result!r}].sel(...).plot()."
        )
    ax = axes_or_new(ax, (5.6, 3.6))
    if values.ndim == 1:
        _draw_line(ax, sweep, values)
        ax.set_ylabel(sweep.label(result))
    else:
        _draw_map(ax, sweep, values, sweep.label(result))
        ax.set_ylabel(sweep.axis_label(1))
    ax.set_xlabel(sweep.axis_label(0))
    return ax


def plot_sweep_panels(
    sweep: Sweep, results: Sequence[str] | None = None, *, axes: "Sequence[Axes] | np.ndarray | None" = None
) -> np.ndarray:
    """Several results of a sweep side by side, each as `plot_sweep` draws it.

    Args:
        sweep: what to draw.
        results: names of the results; all if not given.
        axes: as many axes as results; new ones if not given.

    Returns:
        The axes (results,).

    Raises:
        InputError: an unknown result, or another number of axes than results.
    """
    names = list(sweep.results) if results is None else list(results)
    grid = grid_or_new(axes, len(names), panel=(4.4, 3.2))
    for name, ax in zip(names, grid, strict=True):
        plot_sweep(sweep, name, ax=ax)
    return grid


def _draw_line(ax: "Axes", sweep: Sweep, values: np.ndarray) -> None:
    x = sweep.values[0]
    order = np.argsort(x)
    ax.plot(x[order], values[order], "o-", ms=3.5, lw=1.3, color="C0")
    _scale(ax, x, "x")
    _mark_present(ax, sweep, 0)
    bad = np.isnan(values)
    if bad.any():
        # In axes' height, as there is no value to draw them at.
        place = {"transform": ax.get_xaxis_transform(), "clip_on": False}
        ax.plot(x[bad], np.full(bad.sum(), 0.03), "x", color="C3", ms=6, mew=1.6, ls="none", label="NaN", **place)
    handles, _ = ax.get_legend_handles_labels()
    if handles:
        ax.legend(fontsize="small")
    ax.grid(True, color="0.92", lw=0.6)


def _draw_map(ax: "Axes", sweep: Sweep, values: np.ndarray, label: str) -> None:
    orders = [np.argsort(axis) for axis in sweep.values]
    x, y = (axis[order] for axis, order in zip(sweep.values, orders, strict=True))
    z = values[np.ix_(*orders)].T
    _scale(ax, x, "x")
    _scale(ax, y, "y")
    image = ax.pcolormesh(_edges(x), _edges(y), z, cmap="viridis", rasterized=True)
    ax.figure.colorbar(image, ax=ax, label=label)
    known = z[np.isfinite(z)]
    if min(z.shape) >= 3 and known.size and np.ptp(known) > 0:
        lines = ax.contour(x, y, np.ma.masked_invalid(z), levels=6, colors="white", linewidths=0.7)
        ax.clabel(lines, fontsize="x-small", fmt="%.4g")
    bad = np.argwhere(np.isnan(z))
    if bad.size:
        ax.plot(x[bad[:, 1]], y[bad[:, 0]], "x", color="C3", ms=6, mew=1.6, ls="none", label="NaN")
    _mark_present(ax, sweep, 0, 1)
    handles, _ = ax.get_legend_handles_labels()
    if handles:
        # Above the map, which it would hide.
        ax.legend(fontsize="small", loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False)


def _mark_present(ax: "Axes", sweep: Sweep, *axes: int) -> None:
    now = [1.0 if sweep.relative else sweep.present[axis] for axis in axes]
    inside = [np.min(sweep.values[i]) <= value <= np.max(sweep.values[i]) for i, value in zip(axes, now, strict=True)]
    if not all(inside):
        return
    if len(now) == 1:
        ax.axvline(now[0], color="0.55", lw=1.0, ls="--", label="present value", zorder=0)
    else:
        ax.plot(*now, "o", mfc="white", mec="k", ms=6, ls="none", label="present values")


def _even_ratios(values: np.ndarray) -> bool:
    ordered = np.sort(values)
    if ordered.size < 3 or ordered[0] <= 0 or ordered[-1] < 5 * ordered[0]:
        return False
    ratios = ordered[1:] / ordered[:-1]
    return bool(np.ptp(ratios) < _EVEN * ratios[0])


def _scale(ax: "Axes", values: np.ndarray, which: str) -> None:
    if _even_ratios(values):
        ax.set(**{f"{which}scale": "log"})


def _edges(centres: np.ndarray) -> np.ndarray:
    """Edges of cells about their centres, halfway between them on the scale that they are even on."""
    log = _even_ratios(centres)
    places = np.log(centres) if log else centres
    if places.size == 1:
        half = 0.5 * max(abs(float(places[0])), 1.0)
        return np.array([places[0] - half, places[0] + half])
    middle = 0.5 * (places[1:] + places[:-1])
    edges = np.concatenate([[2 * places[0] - middle[0]], middle, [2 * places[-1] - middle[-1]]])
    return np.exp(edges) if log else edges
