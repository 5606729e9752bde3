"""Pictures of a modal analysis: stabilisation diagram, responses against synthesised ones, shapes, their likeness."""

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import ArrayLike, Inexact

from fitting.identification.modal_result import ModalAnalysis
from twin._axes import axes_or_new
from twin._checks import InputError
from twin.correlation import mac
from twin.correlation.collinearity import real_shapes
from twin.frf import FRF

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_UNITS = {"receptance": "m/N", "mobility": "m/(Ns)", "accelerance": "m/(Ns²)", "ratio": "-"}
_MARKS = (
    {"marker": "o", "mfc": "none", "mec": "0.8", "ms": 2.5, "label": "new"},
    {"marker": "o", "mfc": "none", "mec": "C0", "ms": 3.5, "label": "stable in frequency"},
    {"marker": "d", "mfc": "none", "mec": "C2", "ms": 4.5, "label": "and in damping"},
    {"marker": "+", "mec": "C3", "ms": 5.5, "mew": 1.2, "label": "and in shape"},
)


def mode_indicator(frf: FRF) -> np.ndarray:
    """Complex mode indicator function: singular values of the responses, line by line, largest first (values, lines).

    As many rise at a resonance as there are modes of about that frequency.

    Args:
        frf: responses.

    Source: C. Y. Shih, Y. G. Tsuei, R. J. Allemang, D. L. Brown, "Complex mode indication function and its applications
    to spatial domain parameter estimation", Mechanical Systems and Signal Processing 2 (1988) 367-377.
    """
    return np.linalg.svd(np.moveaxis(np.asarray(frf.values), -1, 0), compute_uv=False).T


def plot_stabilisation(analysis: ModalAnalysis, *, ax: "Axes | None" = None) -> "Axes":
    """Poles of all orders over the mode indicator function; the modes taken as lines.

    Args:
        analysis: the analysis.
        ax: axes to draw in; new ones if not given.
    """
    ax = axes_or_new(ax, (8.6, 4.8))
    behind = ax.twinx()
    for i, line in enumerate(mode_indicator(analysis.measured)):
        behind.plot(analysis.measured.frequency, line, color=f"{0.25 + 0.2 * min(i, 2)}", lw=0.9)
    behind.set_yscale("log")
    behind.set_ylabel(f"mode indicator [{_UNITS[analysis.measured.form]}]")
    ax.set_zorder(behind.get_zorder() + 1)
    ax.patch.set_visible(False)
    diagram = analysis.diagram
    for state, style in enumerate(_MARKS):
        here = diagram.state == state
        ax.plot(diagram.frequency[here], diagram.order[here], ls="none", **style)
    for i, frequency in enumerate(analysis.frequency):
        ax.axvline(frequency, color="C1", lw=1.0, alpha=0.7, zorder=0, label=None if i else "modes taken")
    ax.set_xlabel("frequency [Hz]")
    ax.set_ylabel("order")
    ax.set_xlim(float(analysis.measured.frequency[0]), float(analysis.measured.frequency[-1]))
    ax.set_ylim(0, diagram.orders + 1)
    ax.legend(fontsize="small", ncols=5, loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False, columnspacing=1.0)
    return ax


def plot_synthesis(
    analysis: ModalAnalysis, response: str, excitation: str, *, axes: "np.ndarray | None" = None
) -> np.ndarray:
    """A measured response and that of the modes: magnitude above, phase below.

    Args:
        analysis: the analysis.
        response: name of the response in `analysis.measured`.
        excitation: name of the excitation there.
        axes: two axes; new ones if not given.

    Returns:
        The two axes.
    """
    grid = axes
    if grid is None:
        from matplotlib import pyplot

        grid = pyplot.subplots(2, 1, figsize=(8.6, 5.4), sharex=True, height_ratios=(3, 2), layout="constrained")[1]
    above, below = grid
    frequency = analysis.measured.frequency
    styles = (
        (analysis.measured, {"color": "0.6", "lw": 2.2, "label": "measured"}),
        (analysis.synthesised, {"color": "C3", "lw": 1.0, "label": "modes"}),
    )
    fitted = np.unwrap(np.angle(np.asarray(analysis.synthesised[response, excitation])))
    for one, style in styles:
        values = np.asarray(one[response, excitation])
        above.plot(frequency, np.abs(values), **style)
        # Noise would wind a phase up that is followed by itself: both follow that of the modes.
        away = np.angle(values * np.exp(-1j * fitted))
        below.plot(frequency, np.degrees(fitted + away), **style)
    error = np.abs(np.asarray(analysis.measured[response, excitation] - analysis.synthesised[response, excitation]))
    if np.any(error > 0):
        above.plot(frequency, error, color="C0", lw=0.5, alpha=0.7, label="difference")
    size = np.abs(np.asarray(analysis.measured[response, excitation]))
    above.set_yscale("log")
    if np.any(size > 0):
        above.set_ylim(max(0.1 * size[size > 0].min(), 1e-5 * size.max()), 2 * size.max())
    there, force = (excitation, response) if analysis.reciprocal else (response, excitation)
    above.set_ylabel(f"|{there} / force {force}| [{_UNITS[analysis.measured.form]}]")
    above.legend(fontsize="small", ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False)
    below.set_ylabel("phase [°]")
    low, high = np.degrees(fitted.min()), np.degrees(fitted.max())
    step = 90 * 2 ** max(0, int(np.ceil(np.log2(max(high - low, 1.0) / 450))))
    below.set_yticks(np.arange(step * np.floor(low / step), high + step, step))
    below.set_ylim(low - 60, high + 60)
    below.set_xlabel("frequency [Hz]")
    for ax in (above, below):
        ax.grid(True, which="major", alpha=0.25)
        ax.margins(x=0)
        for mode in analysis.frequency:
            ax.axvline(mode, color="C1", lw=0.7, alpha=0.5, zorder=0)
    return np.asarray(grid)


def plot_mac(
    shapes: Inexact[ArrayLike, "rows modes"],
    reference: Inexact[ArrayLike, "rows references"] | None = None,
    *,
    labels: tuple[list[str], list[str]] | None = None,
    ax: "Axes | None" = None,
) -> "Axes":
    """MAC of all pairs of shapes: of one analysis with itself, or with a reference.

    Args:
        shapes: one shape per column.
        reference: the same for a reference, in the same rows; the shapes themselves if not given.
        labels: names of shapes and of reference; numbers if not given.
        ax: axes to draw in; new ones if not given.
    """
    values = np.asarray(mac(np.asarray(shapes), np.asarray(shapes if reference is None else reference)))
    rows, columns = values.shape
    ax = axes_or_new(ax, (2.4 + 0.34 * columns, 1.6 + 0.34 * rows))
    image = ax.imshow(values, vmin=0, vmax=1, cmap="Blues", aspect="equal")
    ax.figure.colorbar(image, ax=ax, label="MAC [-]")
    if rows * columns <= 225:
        for i, j in np.ndindex(rows, columns):
            if values[i, j] >= 0.05:
                colour = "white" if values[i, j] > 0.6 else "0.2"
                text = f"{values[i, j]:.2f}".replace("0.", ".") if values[i, j] < 0.995 else "1"
                ax.text(j, i, text, ha="center", va="center", fontsize=6, color=colour)
    names = labels or ([str(i + 1) for i in range(rows)], [str(i + 1) for i in range(columns)])
    ax.set_xticks(np.arange(columns), names[1], rotation=90, fontsize="x-small")
    ax.set_yticks(np.arange(rows), names[0], fontsize="x-small")
    return ax


def plot_shape(analysis: ModalAnalysis, mode: int, *, ax: "Axes | None" = None) -> "Axes":
    """One shape as lollipops over the responses, with its standard errors.

    The shape is turned by its phase; what is left across it is drawn as small dots.

    Args:
        analysis: the analysis.
        mode: its number, from 1.
        ax: axes to draw in; new ones if not given.

    Raises:
        InputError: a mode that there is not.
    """
    if not 1 <= mode <= analysis.frequency.size:
        raise InputError(f"There is no mode {mode}: there are {analysis.frequency.size}, counted from 1.")
    shape = analysis.shapes[:, mode - 1 : mode]
    real = real_shapes(shape)[:, 0]
    rows = np.arange(real.size)
    ax = axes_or_new(ax, (min(2.0 + 0.28 * rows.size, 16.0), 3.2))
    turn = np.exp(-0.5j * np.angle(np.sum(shape**2)))
    ax.vlines(rows, 0, real, color="C0", lw=1.2)
    ax.errorbar(
        rows,
        real,
        2 * analysis.shape_errors[:, mode - 1],
        fmt="o",
        ms=3.5,
        color="C0",
        ecolor="0.3",
        capsize=3,
        label="in phase, ± 2 standard errors",
    )
    ax.plot(rows, np.imag(shape[:, 0] * turn), ".", ms=4, color="C3", label="across")
    ax.axhline(0, color="0.3", lw=0.8)
    # Names of so many rows would lie on each other.
    every = max(1, rows.size // 50)
    ax.set_xticks(rows[::every], analysis.measured.outputs[::every], rotation=90, fontsize="x-small")
    ax.set_ylabel("shape [1/√kg]" if analysis.mass_normalised else "shape [-]")
    ax.set_title(
        f"mode {mode}: {analysis.frequency[mode - 1]:.5g} Hz, {100 * analysis.damping_ratio[mode - 1]:.3g} %",
        fontsize="medium",
        loc="left",
    )
    ax.margins(x=0.02)
    # Above the axes, where it hides no point.
    ax.legend(fontsize="x-small", ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return ax
