"""Pictures of a preloaded rack-and-pinion drive: responses, surfaces, quadrants. Each takes axes and returns them."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float

from fitting.identification.load_surface import LoadSurfaceFit
from fitting.identification.preload_chain import ChainPoint
from fitting.residuals.load_surface import total_over_contacts
from twin._axes import axes_or_new, grid_or_new
from twin.laws import AbstractLoadLaw

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_preload_responses(
    points: Sequence[ChainPoint], *, axes: "Sequence[Axes] | np.ndarray | None" = None
) -> "np.ndarray":
    """Magnitude and phase of the response V_T/V_1 at each preload, with the -90° points (Leipe et al., fig. 4).

    Args:
        points: of a `PreloadChain`.
        axes: two axes to draw in, for magnitude and phase; new ones if not given.

    Raises:
        InputError: another number of axes than two.
    """
    from matplotlib import colormaps

    grid = grid_or_new(axes, 2, columns=1, panel=(7.0, 2.8))
    colours = colormaps["viridis"](np.linspace(0.0, 0.9, len(points)))
    for point, colour in zip(points, colours, strict=True):
        f, g = np.asarray(point.response.frequency), np.asarray(point.response.values[0, 0])
        style = {"color": colour, "lw": 1.2, "ls": "-" if point.used else ":"}
        label = f"{point.preload_percent:g} %" + ("" if point.used else ", not fitted")
        grid[0].plot(f, 20 * np.log10(np.abs(g)), label=label, **style)
        grid[1].plot(f, np.degrees(np.unwrap(np.angle(g))), **style)
        if point.peak is not None and point.used:
            marker = {"color": colour, "marker": "o", "ms": 4, "ls": "none"}
            grid[0].plot(point.peak.frequency, 20 * np.log10(point.peak.magnitude), **marker)
            grid[1].plot(point.peak.frequency, -90.0, **marker)
    grid[1].axhline(-90.0, color="0.6", lw=0.8, zorder=0)
    grid[0].set_ylabel("|V_T/V_1| [dB]")
    grid[1].set_ylabel("phase [°]")
    grid[1].set_ylim(-200.0, 30.0)
    grid[1].set_yticks([-180, -135, -90, -45, 0])
    for ax in grid:
        ax.set_xscale("log")
        ax.margins(x=0)
        ax.grid(True, which="both", color="0.92", lw=0.6)
        plain_ticks(ax, [20, 30, 40, 60, 80, 100, 150, 200, 300, 400])
    grid[0].legend(title="preload", fontsize="small", ncols=2)
    grid[1].set_xlabel("frequency [Hz]")
    return grid


def plain_ticks(ax: "Axes", places: Sequence[float | int]) -> None:
    """Plain numbers at some places of a logarithmic abscissa, which keeps its limits.

    Args:
        ax: the axes.
        places: where ticks are wanted; those outside of the limits are left out.
    """
    low, high = ax.get_xlim()
    # The limits of a logarithmic axis carry rounding.
    inside = [place for place in places if low * (1 - 1e-9) <= place <= high * (1 + 1e-9)]
    ax.set_xticks(inside, [f"{place:g}" for place in inside])
    ax.set_xticks([], minor=True)
    ax.set_xlim(low, high)


def plot_load_surface(
    found: LoadSurfaceFit,
    forces: Float[ArrayLike, "2 points"],
    totals: Float[ArrayLike, "points"],
    *,
    label: str,
    scale: float = 1.0,
    ax: "Axes | None" = None,
) -> "Axes":
    """The fitted total over both motor forces with the measured points (Leipe et al., fig. 6 and 7).

    The curves on the walls are one drive train alone, k(F₁, 0) and k(0, F₂).

    Args:
        found: the fitted law.
        forces: motor forces of the points [N].
        totals: measured totals, SI.
        label: what it is, with its unit.
        scale: what the unit is in SI, 1e6 for N/µm.
        ax: three-dimensional axes to draw in; new ones if not given.
    """
    from matplotlib import pyplot

    if ax is None:
        ax = pyplot.figure(figsize=(6.4, 5.0), layout="constrained").add_subplot(projection="3d")
    at, total = np.abs(np.asarray(forces)) / 1e3, np.asarray(totals)
    highest = 1.05 * float(at.max())
    side = np.linspace(0.0, highest, 41)
    f_1, f_2 = np.meshgrid(side, side)
    surface = np.asarray(total_over_contacts(found.law, jnp.stack([1e3 * f_1, 1e3 * f_2])))
    three: "Axes" = ax
    three.plot_surface(f_1, f_2, surface / scale, cmap="viridis", alpha=0.6, lw=0)  # type: ignore[attr-defined]
    single = np.asarray(found.law(1e3 * side)) / scale
    three.plot(side, np.zeros_like(side), single, color="C3", lw=1.6, label="one drive train")
    three.plot(np.zeros_like(side), side, single, color="C3", lw=1.6)
    three.plot(at[0], at[1], total / scale, "ko", ms=4, ls="none", label="measured")  # type: ignore[arg-type]
    three.set_xlabel("|F₁| [kN]")
    three.set_ylabel("|F₂| [kN]")
    three.set_zlabel(label)  # type: ignore[attr-defined]
    three.set_title(f"remaining error {found.error_percent:.2f} %", fontsize="medium")
    three.legend(loc="upper left", fontsize="small")
    return three


def plot_quadrants(
    stiffness: AbstractLoadLaw,
    forces: Float[ArrayLike, "2 samples"],
    *,
    reach: float | None = None,
    ax: "Axes | None" = None,
) -> "Axes":
    """Total stiffness over both motor forces in all four quadrants, and the way that a motion takes (fig. 5).

    On the axes between two quadrants one motor passes through its play, and the stiffness is that of the other alone;
    where the way stays in the second or fourth quadrant the preload holds.

    Args:
        stiffness: k(F) of one drive train.
        forces: forces of the motion [N].
        reach: largest force shown [N]; a little more than the motion's if not given.
        ax: axes to draw in; new ones if not given.
    """
    ax = axes_or_new(ax, (5.6, 4.6))
    way = np.asarray(forces) / 1e3
    limit = 1.15 * float(np.max(np.abs(way))) if reach is None else reach / 1e3
    side = np.linspace(-limit, limit, 201)
    f_1, f_2 = np.meshgrid(side, side)
    total = np.asarray(total_over_contacts(stiffness, jnp.stack([1e3 * f_1, 1e3 * f_2]))) / 1e6
    filled = ax.contourf(f_1, f_2, total, levels=16, cmap="viridis")
    ax.figure.colorbar(filled, ax=ax, label="k(F₁) + k(F₂) [N/µm]")
    ax.plot(way[0], way[1], color="C3", lw=1.2, label="motion")
    ax.plot(way[0, :1], way[1, :1], "o", color="C3", ms=5, label="start")
    ax.axhline(0.0, color="white", lw=0.8)
    ax.axvline(0.0, color="white", lw=0.8)
    for name, x, y in (("(1)", 0.9, 0.92), ("(2)", 0.04, 0.92), ("(3)", 0.04, 0.04), ("(4)", 0.9, 0.04)):
        ax.text(x, y, name, transform=ax.transAxes, color="white")
    ax.set_xlabel("F₁ [kN]")
    ax.set_ylabel("F₂ [kN]")
    ax.set_aspect("equal")
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, fontsize="small", frameon=False)
    return ax
