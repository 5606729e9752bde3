"""Pictures of a sensitivity study: ranking, heat map, convergence, elementary effects. Each takes `ax`, returns it."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sensitivity.morris import ElementaryEffects
from sensitivity.sobol_result import SobolIndices
from twin._axes import axes_or_new
from twin._checks import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_FIRST, _TOTAL = "#9ecae1", "#08519c"
# Share of the largest effect under which points lie on top of each other.
_CROWD = 0.1


def plot_indices(
    indices: SobolIndices,
    output: str | int,
    *,
    top: int = 10,
    threshold: float | None = None,
    names: Mapping[str, str] | None = None,
    ax: "Axes | None" = None,
) -> "Axes":
    """First-order and total indices of the most significant parameters as bars, intervals as whiskers.

    As in figure 5 of J. Ellinger and M. F. Zaeh, Machines 10 (2022) 535.

    Args:
        indices: Sobol study.
        output: name or number of the output.
        top: most parameters drawn, by total effect.
        threshold: total effect from which a parameter matters, drawn as a line if given.
        names: what to write instead of a parameter's path, by path.
        ax: axes to draw in; new ones if not given.
    """
    ax = axes_or_new(ax)
    row = indices.index(output)
    order = _strongest(indices.ST[row], top)
    at = np.arange(order.size)
    whiskers = {"lw": 0.9, "capsize": 2.5, "ecolor": "0.15"}
    first, total = (
        (indices.S1, indices.S1_conf, _FIRST, "first order $S_i$"),
        (indices.ST, indices.ST_conf, _TOTAL, "total $S_{Ti}$"),
    )
    for shift, (index, half, colour, label) in ((-0.2, first), (0.2, total)):
        error = half[row, order]
        ax.bar(at + shift, index[row, order], 0.4, yerr=error, color=colour, label=label, error_kw=whiskers)
    if threshold is not None:
        ax.axhline(threshold, color="C3", lw=0.9, ls="--", label=f"threshold {threshold:g}")
    ax.axhline(0, color="0.15", lw=0.6)
    ax.set_xticks(at, [_written(indices.names[k], names) for k in order], rotation=40, ha="right", fontsize="small")
    ax.set_ylabel("Sobol index [-]")
    ax.set_title(f"{indices.outputs[row]}, {100 * indices.confidence:g} % intervals", fontsize="medium")
    ax.legend(fontsize="small", frameon=False)
    return ax


def plot_heat_map(
    indices: SobolIndices,
    columns: Mapping[str, Sequence[str]] | None = None,
    *,
    labels: Sequence[str] | None = None,
    threshold: float = 0.01,
    names: Mapping[str, str] | None = None,
    ax: "Axes | None" = None,
) -> "Axes":
    """Total effect of every parameter on many outputs, as for each mode at each axis position.

    Args:
        indices: Sobol study.
        columns: names of the outputs to draw, by the title of their block: the modes of a position, say. By default all
            outputs in one block.
        labels: what to write under the columns of each block, as many as the largest block has; by default their
            numbers within the block, from 1.
        threshold: total effect from which a parameter matters: what is not above stays white.
        names: what to write instead of a parameter's path, by path.
        ax: axes to draw in; new ones if not given.

    Raises:
        InputError: an unknown output, or too few labels.
    """
    from matplotlib.colors import LogNorm

    blocks = {"": indices.outputs} if columns is None else {title: tuple(block) for title, block in columns.items()}
    drawn = [indices.index(name) for block in blocks.values() for name in block]
    longest = max((len(block) for block in blocks.values()), default=0)
    if not longest:
        raise InputError("columns names no outputs. Give at least one block with one name.")
    under = [str(i + 1) for i in range(longest)] if labels is None else list(labels)
    if len(under) < longest:
        raise InputError(f"labels holds {len(under)} texts, but the largest block has {longest} columns.")
    if ax is None:
        ax = axes_or_new(None, (min(16.0, 2.6 + 0.2 * len(drawn)), 1.3 + 0.2 * len(indices.names)))
    shares = indices.ST[drawn].T
    shown = np.ma.masked_less_equal(shares, threshold)
    image = ax.imshow(shown, aspect="auto", cmap="viridis_r", norm=LogNorm(threshold, 1.0, clip=True))
    start, ticks = 0, []
    for title, block in blocks.items():
        ticks += under[: len(block)]
        if title:
            ax.text(start + len(block) / 2 - 0.5, -0.8, title, ha="center", va="bottom")
        start += len(block)
        if start < len(drawn):
            ax.axvline(start - 0.5, color="0.15", lw=1.0)
    ax.set_xticks(np.arange(len(drawn)), ticks, fontsize="x-small", rotation=90 if max(map(len, ticks)) > 2 else 0)
    rows = [_written(name, names) for name in indices.names]
    ax.set_yticks(np.arange(len(rows)), rows, fontsize="x-small")
    ax.set_xticks(np.arange(len(drawn) + 1) - 0.5, minor=True)
    ax.set_yticks(np.arange(len(indices.names) + 1) - 0.5, minor=True)
    ax.grid(which="minor", color="0.9", lw=0.4)
    ax.tick_params(which="minor", length=0)
    ax.figure.colorbar(image, ax=ax, label=f"total effect $S_{{Ti}}$ above {threshold:g} [-]", pad=0.01)
    return ax


def plot_convergence(
    indices: SobolIndices, output: str | int, *, top: int = 5, order: str = "total", ax: "Axes | None" = None
) -> "Axes":
    """Indices of the strongest parameters against the number of base points, with their intervals.

    Args:
        indices: Sobol study.
        output: name or number of the output.
        top: most parameters drawn, by total effect.
        order: "total" or "first".
        ax: axes to draw in; new ones if not given.

    Raises:
        InputError: another order, an unknown output.
    """
    if order not in ("total", "first"):
        raise InputError(f'order must be "total" or "first", but is {order!r}.')
    ax = axes_or_new(ax)
    row = indices.index(output)
    total = order == "total"
    by_size = indices.ST_by_size if total else indices.S1_by_size
    half = indices.ST_conf_by_size if total else indices.S1_conf_by_size
    strongest = _strongest(indices.ST[row], top)
    for i, k in enumerate(strongest):
        # Side by side: whiskers on top of each other cannot be read.
        at = indices.sizes * 1.03 ** (i - (strongest.size - 1) / 2)
        ax.errorbar(at, by_size[:, row, k], half[:, row, k], marker="o", ms=4, capsize=2.5, label=indices.names[k])
    ax.set_xscale("log", base=2)
    ax.set_xticks(indices.sizes, [str(size) for size in indices.sizes])
    ax.minorticks_off()
    ax.set_xlabel("base points n")
    ax.set_ylabel("total effect $S_{Ti}$ [-]" if total else "first-order index $S_i$ [-]")
    ax.set_title(indices.outputs[row], fontsize="medium")
    ax.legend(fontsize="small", loc="upper left", bbox_to_anchor=(1.01, 1.0))
    ax.grid(True, alpha=0.3)
    return ax


def plot_effects(
    effects: ElementaryEffects, output: str | int, *, top: int = 10, unit: str = "", ax: "Axes | None" = None
) -> "Axes":
    """Spread σ of the elementary effects over their mean magnitude μ*: on the right what matters, high up what acts
    non-linearly or together with others.

    Args:
        effects: Morris study.
        output: name or number of the output.
        top: most parameters named, by μ*; the crowd near the origin is not.
        unit: unit of the output, for the axes.
        ax: axes to draw in; new ones if not given.
    """
    ax = axes_or_new(ax, (5.2, 3.8))
    row = effects.index(output)
    x, y = effects.mu_star[row], effects.sigma[row]
    ax.errorbar(x, y, effects.sigma_conf[row], effects.mu_star_conf[row], fmt="o", ms=4, lw=0.8, color=_TOTAL)
    named = [k for k in _strongest(x, top) if x[k] > _CROWD * x.max()]
    for i, k in enumerate(named):
        # In turn above and below the point: neighbours' names would cover each other.
        shift = (4, -10) if i % 2 else (4, 4)
        ax.annotate(effects.names[k], (x[k], y[k]), shift, textcoords="offset points", fontsize="x-small")
    end = 1.08 * float(np.max([x + effects.mu_star_conf[row], y + effects.sigma_conf[row]], initial=0.0)) or 1.0
    ax.plot([0, end], [0, end], color="0.6", lw=0.8, ls="--", label="σ = μ*")
    ax.set_xlim(0, end)
    ax.set_ylim(0, end)
    ax.set_xlabel(f"μ* [{unit or '-'}]")
    ax.set_ylabel(f"σ [{unit or '-'}]")
    ax.set_title(effects.outputs[row], fontsize="medium")
    ax.legend(fontsize="small")
    return ax


def _written(name: str, names: Mapping[str, str] | None) -> str:
    return name if names is None else names.get(name, name)


def _strongest(values: np.ndarray, top: int) -> np.ndarray:
    if top < 1:
        raise InputError(f"top must be at least 1, but is {top}.")
    return np.argsort(-values, kind="stable")[:top]
