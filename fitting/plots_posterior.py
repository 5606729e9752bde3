"""Pictures of posterior samples: marginals against linear theory and profiles, and pairs of parameters."""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy import stats

from fitting.plots_axes import add_shared_legend, is_wide, scale_axis
from fitting.posterior_result import Posterior
from fitting.profile import ProfileResult
from fitting.result import FitResult
from twin._axes import grid_or_new
from twin._checks import InputError
from twin.parameters import Parameter

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SHOWN = 2000


def plot_posterior(
    posterior: Posterior,
    *,
    fit: FitResult | None = None,
    profile: ProfileResult | None = None,
    level: float = 0.95,
    axes: "Sequence[Axes] | np.ndarray | None" = None,
) -> "np.ndarray":
    """Marginal densities of all parameters, chain by chain in thin lines, with what linear theory and profiles say.

    Where the abscissa is logarithmic the density is that of the logarithm.

    Args:
        posterior: samples.
        fit: for the normal (known variance) or Student's t density of linear theory.
        profile: for the intervals of the profile likelihood, where it has them.
        level: probability of the credible interval, which is shaded.
        axes: axes to draw in, one for each parameter; new ones if not given.

    Returns:
        The axes (parameters,).

    Raises:
        InputError: another number of axes than parameters, level outside (0, 1).
    """
    grid = grid_or_new(axes, len(posterior.space))
    intervals = posterior.intervals(level)
    for i, (ax, parameter) in enumerate(zip(grid, posterior.space.parameters, strict=True)):
        values = posterior.values[:, :, i]
        edges = _edges(ax, parameter, values)
        for number, chain in enumerate(values):
            label = "chains" if number == 0 else None
            ax.stairs(_density(ax, chain, edges), edges, color="0.6", lw=0.6, label=label)
        ax.stairs(_density(ax, values, edges), edges, color="C0", lw=1.6, label="posterior")
        ax.axvspan(*intervals[i], color="C0", alpha=0.15, lw=0, label=f"{100 * level:g} % credible")
        if fit is not None and parameter.path in fit.space.paths:
            _draw_linear(ax, parameter, fit, edges)
        if profile is not None and parameter.path in {p.path for p in profile.profiles}:
            label = f"{100 * profile.level:g} % profile interval"
            for number, end in enumerate(profile[parameter.path].interval):
                if np.isfinite(end):
                    ax.axvline(end, color="C2", ls="--", lw=1.3, label=label if number == 0 else None)
        ax.set_xlim(edges[0], edges[-1])
        ax.set_ylim(bottom=0)
        ax.set_yticks([])
        ax.set_xlabel(parameter.label)
    grid[0].set_ylabel("density")
    if axes is None:
        add_shared_legend(grid, 5)
    return grid


def plot_pairs(
    posterior: Posterior, *, paths: Iterable[str] | None = None, axes: "Sequence[Axes] | np.ndarray | None" = None
) -> "np.ndarray":
    """Samples of every pair of parameters, coloured by chain, with the marginals on the diagonal.

    Bananas, bounds and several modes show here; colours that do not mix are chains that disagree.

    Args:
        posterior: samples; at most 2000 are drawn.
        paths: parameters to draw; all if not given.
        axes: axes to draw in, as many as the square of the number of parameters; new ones if not given.

    Returns:
        The axes (parameters, parameters), those above the diagonal not used.

    Raises:
        InputError: a parameter that was not sampled, another number of axes.
    """
    names = tuple(posterior.space.paths if paths is None else paths)
    if not names:
        raise InputError("paths is empty. Name the parameters to draw.")
    count, samples = len(names), [posterior[name] for name in names]
    grid = grid_or_new(axes, count**2, columns=count, panel=(2.1, 1.9)).reshape(count, count)
    chains, length = samples[0].shape
    every = max(1, chains * length // _SHOWN)
    for i in range(count):
        for j in range(count):
            ax = grid[i, j]
            if j > i:
                ax.set_axis_off()
                continue
            edges = _edges(ax, posterior.space[names[j]], samples[j])
            if i == j:
                for k in range(chains):
                    ax.stairs(_density(ax, samples[j][k], edges), edges, color=f"C{k}", lw=1.0)
                ax.set_ylim(bottom=0)
                ax.set_yticks([])
            else:
                for k in range(chains):
                    x, y = samples[j][k, ::every], samples[i][k, ::every]
                    ax.plot(x, y, ".", ms=1.5, color=f"C{k}", alpha=0.5, rasterized=True)
                other = _edges(None, posterior.space[names[i]], samples[i])
                ax.set_ylim(other[0], other[-1])
                if is_wide(posterior.space[names[i]], samples[i]):
                    ax.set_yscale("log")
            ax.set_xlim(edges[0], edges[-1])
            if i == count - 1:
                ax.set_xlabel(_broken(posterior.space[names[j]]), fontsize="small")
            if j == 0 and i > 0:
                ax.set_ylabel(_broken(posterior.space[names[i]]), fontsize="small")
            ax.tick_params(labelsize="x-small", labelbottom=i == count - 1, labelleft=j == 0 and i > 0)
    return grid


def _draw_linear(ax: "Axes", parameter: Parameter, fit: FitResult, edges: np.ndarray) -> None:
    """Density of linear theory: normal or Student's t in the variable that the fit moves."""
    index = fit.space.paths.index(parameter.path)
    error = float(np.sqrt(fit.scaled_covariance[index, index]))
    freedom = np.inf if fit.variance == "known" else fit.degrees_of_freedom
    if not (np.isfinite(error) and error > 0 and freedom >= 1):
        return
    spaced = np.linspace if ax.get_xscale() == "linear" else np.geomspace
    values = spaced(float(edges[0]), float(edges[-1]), 301)
    scaled = np.asarray(parameter.to_scaled(values))
    density = stats.t.pdf((scaled - fit.scaled[index]) / error, freedom) / error
    if ax.get_xscale() == "linear":
        density = density / np.asarray(parameter.slope(values))
    ax.plot(values, density, color="C3", lw=1.2, label="linear theory")


def _density(ax: "Axes", values: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Histogram as a density: of the logarithm on a logarithmic axis, so that areas are what they look like."""
    width = np.diff(edges) if ax.get_xscale() == "linear" else np.diff(np.log(edges))
    return np.histogram(values, edges)[0] / (values.size * width)


def _edges(ax: "Axes | None", parameter: Parameter, values: np.ndarray) -> np.ndarray:
    """Edges of a histogram over all but the outermost thousandths, on the parameter's axis."""
    if ax is not None:
        scale_axis(ax, parameter, values.ravel())
    low, high = np.quantile(values, [0.001, 0.999])
    log = is_wide(parameter, values)
    low, high = (np.log(low), np.log(high)) if log else (low, high)
    room = 0.08 * (high - low) or 1e-6 * max(abs(low), 1e-300)
    edges = np.linspace(low - room, high + room, 31)
    return np.exp(edges) if log else edges


def _broken(parameter: Parameter) -> str:
    """Its label, broken before the last part of the path if long."""
    label, last = parameter.label, parameter.path.rfind(".") + 1
    return f"{label[:last]}\n{label[last:]}" if last and len(parameter.path) > 16 else label
