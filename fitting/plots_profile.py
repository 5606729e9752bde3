"""Pictures of profile likelihoods: how the cost rises, where the intervals end, and what linear theory says."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fitting.plots_axes import add_shared_legend, scale_axis
from fitting.profile import Profile, ProfileResult
from fitting.result import FitResult
from twin._axes import axes_or_new, grid_or_new
from twin.parameters import Parameter

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_profile(
    result: ProfileResult, path: str, *, fit: FitResult | None = None, squared: bool = False, ax: "Axes | None" = None
) -> "Axes":
    """Profile of one parameter with its critical level and interval.

    The profile t is straight where linear theory holds; the squared one is then a parabola, and shows how the cost
    itself rises.

    Args:
        result: of `profile`.
        path: parameter to draw.
        fit: the fit, for the line of linear theory and the parameter's scale.
        squared: draw the rise of the cost 2·(C - Ĉ)/s² instead of the profile t.
        ax: axes to draw in; new ones if not given.

    Raises:
        InputError: a parameter that was not profiled.
    """
    found = result[path]
    ax = axes_or_new(ax, (5.0, 3.4))
    _draw(ax, found, result.critical, fit, squared)
    ax.set_ylabel(_ordinate(squared))
    ax.set_title(f"{100 * result.level:g} % interval: {_interval(found)}", fontsize="medium")
    ax.legend(fontsize="small", loc="best")
    return ax


def plot_profiles(
    result: ProfileResult,
    *,
    fit: FitResult | None = None,
    squared: bool = False,
    columns: int = 3,
    axes: "Sequence[Axes] | np.ndarray | None" = None,
) -> "np.ndarray":
    """All profiles in a grid.

    Args:
        result: of `profile`.
        fit: the fit, for the lines of linear theory and the parameters' scales.
        squared: as in `plot_profile`.
        columns: most panels in a row.
        axes: axes to draw in, one for each profile; new ones if not given.

    Returns:
        The axes (profiles,).

    Raises:
        InputError: another number of axes than profiles.
    """
    grid = grid_or_new(axes, len(result.profiles), columns=columns)
    for i, (ax, found) in enumerate(zip(grid, result.profiles, strict=True)):
        _draw(ax, found, result.critical, fit, squared)
        ax.set_title(_interval(found), fontsize="small")
        if i % columns == 0:
            ax.set_ylabel(_ordinate(squared))
    if axes is None:
        add_shared_legend(grid, 4)
    return grid


def _draw(ax: "Axes", found: Profile, critical: float, fit: FitResult | None, squared: bool) -> None:
    parameter = Parameter(found.path, found.unit) if fit is None else fit.space[found.path]
    height = found.ratio**2 if squared else found.ratio
    ax.plot(found.values, height, "o-", color="C0", ms=3.5, lw=1.2, label="profile", zorder=4)
    ax.plot([found.estimate], [0.0], "D", color="k", ms=5, label="estimate", zorder=5)
    ends = [(end, side) for end, side, open_ in zip(found.interval, (-1, 1), found.open, strict=True) if not open_]
    for end, side in ends:
        ax.plot([end, end], [0, critical**2 if squared else side * critical], ":", color="C3", lw=1.4)
    for level in (critical**2,) if squared else (-critical, critical):
        ax.axhline(level, color="C3", lw=1.0, ls="--", label="critical level" if level > 0 else None)
    reach = np.asarray([found.values.min(), found.values.max()])
    if fit is not None:
        _draw_line(ax, parameter, fit, reach, squared)
    for side, open_ in zip((-1, 1), found.open, strict=True):
        if open_:
            place = {"ha": "left", "x": 0.03} if side < 0 else {"ha": "right", "x": 0.97}
            word = "no limit below" if side < 0 else "no limit above"
            ax.text(
                y=0.65 if squared else 0.5,
                s=word,
                color="C3",
                fontsize="small",
                transform=ax.transAxes,
                va="center",
                zorder=6,
                bbox={"fc": "w", "ec": "none", "alpha": 0.85, "pad": 1},
                **place,
            )
    top = 1.25 * max(critical**2 if squared else critical, float(np.max(np.abs(height), initial=0.0)) / 1.15)
    ax.set_ylim(-0.05 * top if squared else -top, top)
    ax.margins(x=0.06)
    scale_axis(ax, parameter, found.values)
    ax.set_xlabel(parameter.label)


def _draw_line(ax: "Axes", parameter: Parameter, fit: FitResult, reach: np.ndarray, squared: bool) -> None:
    """Linear theory: straight in the variable that the fit moves."""
    index = fit.space.paths.index(parameter.path)
    error = float(np.sqrt(fit.scaled_covariance[index, index]))
    if not (np.isfinite(error) and error > 0):
        return
    ends = np.asarray(parameter.to_scaled(reach))
    scaled = np.linspace(ends[0], ends[1], 101)
    ratio = (scaled - fit.scaled[index]) / error
    values = np.asarray(parameter.from_scaled(scaled))
    ax.plot(values, ratio**2 if squared else ratio, color="0.5", lw=1.2, label="linear theory", zorder=3)


def _ordinate(squared: bool) -> str:
    return "2·(C − Ĉ)/s² [-]" if squared else "profile t [-]"


def _interval(found: Profile) -> str:
    low, high = (
        f"{end:.4g}" if np.isfinite(end) else "∞" if end > 0 else "−∞" for end in (float(e) for e in found.interval)
    )
    return f"{low} … {high}{' ' + found.unit if found.unit else ''}"
