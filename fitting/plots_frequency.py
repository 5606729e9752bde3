"""Plots of frequency responses: measured against model, and the error between them against the scatter."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import ArrayLike, Float

from twin._axes import axes_or_new
from twin._checks import InputError
from twin.frf import FRF

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MEASURED, _MODEL = {"marker": "o", "markersize": 3.0, "linestyle": "none", "color": "C0"}, {"color": "C1", "lw": 1.5}


def plot_magnitude(
    measured: FRF,
    response: str,
    excitation: str,
    *,
    model: FRF | None = None,
    unit: str = "rad/A",
    ax: "Axes | None" = None,
) -> "Axes":
    """Magnitude of a measured response, and of a model's.

    Args:
        measured: measured response.
        response: name of the response.
        excitation: name of the excitation.
        model: the same response of a model, on frequencies of its own; none if not given.
        unit: unit of the response per excitation, for the axis.
        ax: axes to draw into; new ones if not given.

    Returns:
        The axes.
    """
    ax = axes_or_new(ax, (6.4, 4.8))
    ax.plot(measured.frequency, np.abs(measured[response, excitation]), label="measured", **_MEASURED)
    if model is not None:
        ax.plot(model.frequency, np.abs(model[response, excitation]), label="model", **_MODEL)
    ax.set_yscale("log")
    _frequency_axis(ax, measured)
    ax.set_ylabel(f"|{_words(response)} / {_words(excitation)}| [{unit}]")
    ax.legend()
    return ax


def plot_phase(
    measured: FRF, response: str, excitation: str, *, model: FRF | None = None, ax: "Axes | None" = None
) -> "Axes":
    """Phase of a measured response, and of a model's, in degrees.

    With a model the measured phase is drawn on the turn nearest to the model's, otherwise unwrapped from line to line.

    Args:
        measured: measured response.
        response: name of the response.
        excitation: name of the excitation.
        model: the same response of a model, on frequencies of its own that reach over the measured ones.
        ax: axes to draw into; new ones if not given.

    Returns:
        The axes.
    """
    ax = axes_or_new(ax, (6.4, 4.8))
    phase = np.unwrap(np.angle(np.asarray(measured[response, excitation])))
    smooth = None
    if model is not None:
        smooth = np.unwrap(np.angle(np.asarray(model[response, excitation])))
        smooth -= 2 * np.pi * np.ceil((smooth[0] - 1e-9) / (2 * np.pi))
        there = np.interp(measured.frequency, model.frequency, smooth)
        phase = there + (phase - there + np.pi) % (2 * np.pi) - np.pi
    ax.plot(measured.frequency, np.degrees(phase), label="measured", **_MEASURED)
    if model is not None and smooth is not None:
        ax.plot(model.frequency, np.degrees(smooth), label="model", **_MODEL)
    _frequency_axis(ax, measured)
    ax.set_ylabel(f"phase of {_words(response)} / {_words(excitation)} [°]")
    ax.legend()
    return ax


def plot_log_error(
    frequency: Float[ArrayLike, "lines"],
    error: Float[ArrayLike, "lines"],
    *,
    scatter: Mapping[str, tuple[ArrayLike, ArrayLike] | float] | None = None,
    ax: "Axes | None" = None,
) -> "Axes":
    """Size of a log-magnitude error over frequency, against measures of the scatter, in percent on a log scale.

    Args:
        frequency: lines [Hz].
        error: ln|G/Ĝ| at each line.
        scatter: by label, either one relative level, drawn as a line across, or (frequency, relative level).
        ax: axes to draw into; new ones if not given.

    Returns:
        The axes.

    Raises:
        InputError: if the error does not have one value for each line.
    """
    f, size = np.asarray(frequency), 100 * np.abs(np.asarray(error))
    if f.shape != size.shape:
        raise InputError(f"error has shape {size.shape}, but frequency has {f.shape}. Give one error for each line.")
    from matplotlib.ticker import FuncFormatter

    ax = axes_or_new(ax, (6.4, 4.8))
    ax.plot(f, size, label="|ln(model / measured)|", zorder=5, **{**_MEASURED, "markersize": 4.5, "color": "k"})
    for number, (label, level) in enumerate((scatter or {}).items()):
        color = f"C{number}"
        if isinstance(level, float | int):
            ax.axhline(100 * level, color=color, ls="--", label=label)
        else:
            ax.plot(np.asarray(level[0]), 100 * np.asarray(level[1]), color=color, lw=1.0, label=label)
    ax.set_yscale("log")
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.set_xlabel("frequency [Hz]")
    ax.set_ylabel("relative error, scatter [%]")
    ax.grid(True, which="major", alpha=0.3)
    ax.legend(fontsize="small")
    return ax


def _frequency_axis(ax: "Axes", measured: FRF) -> None:
    from matplotlib.ticker import NullFormatter, ScalarFormatter

    ax.set_xscale("log")
    low, high = float(measured.frequency[0]), float(measured.frequency[-1])
    ticks = [t for t in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000) if low / 1.5 <= t <= 1.2 * high]
    if ticks:
        ax.set_xticks(ticks)
        ax.xaxis.set_major_formatter(ScalarFormatter())
        ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_xlabel("frequency [Hz]")
    ax.grid(True, which="major", alpha=0.3)


def _words(name: str) -> str:
    return name.replace("_", " ")
