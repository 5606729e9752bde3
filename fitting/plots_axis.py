"""Pictures of a controlled axis: closed-loop response, a motion over time, what deforms in a mode."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import jax
import numpy as np

from twin._axes import axes_or_new, grid_or_new
from twin._checks import InputError
from twin.drives import SpringDeformations
from twin.frf import FRF
from twin.references import AbstractReference
from twin.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SPRINGS = {
    "shaft": "shaft\n$Δ_{12}^T$",
    "torsion": "screw, torsion\n$Δ_{23}^T$",
    "support": "support, screw\n$Δ_{0}^A$",
    "nut": "nut\n$Δ_{12}^A$",
    "flange": "flange\n$Δ_{23}^A$",
}


def plot_closed_loop(
    frf: FRF,
    *,
    output: str | None = None,
    label: str | None = None,
    axes: "Sequence[Axes] | np.ndarray | None" = None,
) -> "np.ndarray":
    """Amplitude and phase of a closed loop over the frequency (Mauro et al., Fig. 7).

    Drawn again into the same axes, a second response joins the first.

    Args:
        frf: response, as `twin.control.closed_loop_response` gives it, or a measured one.
        output: which output of several.
        label: what the line is, for the legend.
        axes: two axes to draw in, for amplitude and phase; new ones if not given.

    Returns:
        The two axes.

    Raises:
        InputError: another number of axes than two, several outputs and none named.
    """
    if output is None:
        if len(frf.outputs) > 1:
            raise InputError(f"The response has the outputs {', '.join(frf.outputs)}. Name one.")
        output = next(iter(frf.outputs))
    grid = grid_or_new(axes, 2, columns=1, panel=(7.0, 2.6))
    f, g = np.asarray(frf.frequency), np.asarray(frf[output, frf.inputs[0]])
    grid[0].plot(f, 20 * np.log10(np.abs(g)), lw=1.4, label=label)
    grid[1].plot(f, np.degrees(np.unwrap(np.angle(g))), lw=1.4, label=label)
    # The set position and what answers it have one unit, so that their ratio has none.
    plain = output in ("position", "reference")
    grid[0].set_ylabel("amplitude [dB]" if plain else f"{output} per set position [dB]")
    grid[1].set_ylabel("phase [°]")
    grid[1].set_xlabel("frequency [Hz]")
    for ax in grid:
        ax.set_xscale("log")
        ax.margins(x=0)
        ax.grid(True, which="both", color="0.92", lw=0.6)
    grid[1].yaxis.set_major_locator(_degrees())
    if label is not None:
        grid[0].legend(fontsize="small")
    return grid


def plot_time_response(
    trajectory: Trajectory,
    reference: AbstractReference,
    *,
    label: str = "simulated",
    axes: "Sequence[Axes] | np.ndarray | None" = None,
) -> "np.ndarray":
    """Position with its reference, and torque of the motor, over time (Mauro et al., Fig. 8).

    Args:
        trajectory: of an axis that records `position` and `torque`.
        reference: what it was told to do.
        label: what the line is, for the legend.
        axes: two axes to draw in, for position and torque; new ones if not given.

    Returns:
        The two axes.

    Raises:
        InputError: another number of axes than two, an axis without these outputs.
    """
    position, torque = (np.asarray(trajectory.channel(name)) for name in ("position", "torque"))
    grid = grid_or_new(axes, 2, columns=1, panel=(7.0, 2.4))
    t = np.asarray(trajectory.times)
    wanted = np.asarray(jax.vmap(reference)(trajectory.times).position)
    grid[0].plot(t, 1e3 * wanted, color="0.8", lw=3.5, label="reference")
    grid[0].plot(t, 1e3 * position, lw=1.3, label=label)
    grid[1].plot(t, torque, lw=1.1, label=label)
    grid[0].set_ylabel("position [mm]")
    grid[1].set_ylabel("motor torque [Nm]")
    grid[1].set_xlabel("time [s]")
    grid[0].legend(fontsize="small")
    for ax in grid:
        ax.margins(x=0)
        ax.grid(True, color="0.92", lw=0.6)
    return grid


def plot_spring_deformations(deformations: SpringDeformations, *, ax: "Axes | None" = None) -> "Axes":
    """How far a mode deforms each spring, as travel of the slide relative to the largest (Mauro et al., Fig. 9).

    A mode has no amplitude of its own: only the ratios mean something.

    Args:
        deformations: of one mode; twists are shown by the travel that they make.
        ax: axes to draw in; new ones if not given.

    Returns:
        The axes.
    """
    ax = axes_or_new(ax, (5.6, 3.4))
    sizes = np.abs([float(getattr(deformations.axial, name)) for name in _SPRINGS])
    largest = int(np.argmax(sizes))
    colours = ["C0" if i == largest else "0.65" for i in range(len(sizes))]
    bars = ax.bar(list(_SPRINGS.values()), sizes / sizes[largest], color=colours, width=0.6)
    ax.bar_label(bars, fmt="%.2g", padding=2, fontsize="small")
    ax.set_ylim(0.0, 1.12)
    ax.set_ylabel("axial deformation, largest = 1 [-]")
    ax.tick_params(axis="x", labelsize="small", length=0)
    return ax


def _degrees() -> "object":
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(nbins=6, steps=[1, 1.5, 3, 4.5, 9, 10])
