"""Pictures of a modal analysis as files."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fitting.identification.modal_result import ModalAnalysis
from fitting.plots_modal import plot_mac, plot_shape, plot_stabilisation, plot_synthesis

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_RESPONSES, MOST_SHAPES = 24, 24
"""Responses and shapes of which pictures are drawn."""
_FEW = 4


def write_pictures(analysis: ModalAnalysis, out: Path) -> None:
    """Write `stabilisation.png`, `responses.png`, `shapes.png`, and `mac.png` where it means something.

    Args:
        analysis: the analysis.
        out: folder.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    plot_stabilisation(analysis, ax=figure.subplots())
    _save(figure, out / "stabilisation.png")
    _draw_responses(analysis, out / "responses.png")
    if mac_tells(analysis):
        count = analysis.frequency.size
        labels = [f"{f:.4g} Hz" for f in analysis.frequency]
        figure = Figure(figsize=(2.8 + 0.34 * count, 2.0 + 0.34 * count), layout="constrained")
        plot_mac(analysis.shapes, labels=(labels, labels), ax=figure.subplots())
        _save(figure, out / "mac.png")
    _draw_shapes(analysis, out / "shapes.png")


def mac_tells(analysis: ModalAnalysis) -> bool:
    """Whether a MAC of the shapes means something: among fewer points than modes shapes are alike by necessity.

    Args:
        analysis: the analysis.
    """
    return 1 < analysis.frequency.size <= len(analysis.measured.outputs)


def drawn_responses(analysis: ModalAnalysis) -> list[tuple[str, str]]:
    """Which (response, excitation) are drawn: the driving points first, then the largest, at most 24.

    Args:
        analysis: the analysis.
    """
    frf = analysis.measured
    size = np.sum(np.abs(np.asarray(frf.values)) ** 2, axis=-1)
    ranked = [(frf.outputs[i], frf.inputs[j]) for i, j in np.argwhere(size >= 0)[np.argsort(-size.ravel())]]
    return sorted(ranked, key=lambda pair: pair[0] != pair[1])[:MOST_RESPONSES]


def _draw_responses(analysis: ModalAnalysis, file: Path) -> None:
    from matplotlib.figure import Figure

    chosen = drawn_responses(analysis)
    few = len(chosen) <= _FEW
    columns = min(len(chosen), 2 if few else 4)
    rows = -(-len(chosen) // columns)
    width, height = (8.0, 4.6) if few else (4.6, 3.4)
    figure = Figure(figsize=(width * columns, height * rows), layout="constrained")
    every = len(analysis.measured.outputs) * len(analysis.measured.inputs)
    share = (
        f"all {every}" if len(chosen) == every else f"{len(chosen)} of {every}, driving points and the largest first"
    )
    figure.suptitle(f"Measured and synthesised responses ({share})")
    panels = np.asarray(figure.subfigures(rows, columns, squeeze=False)).ravel()
    for panel, (response, excitation) in zip(panels, chosen, strict=False):
        axes = panel.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        plot_synthesis(analysis, response, excitation, axes=axes)
        if not few:
            for ax in axes:
                ax.yaxis.label.set_size("x-small")
    _save(figure, file)


def _draw_shapes(analysis: ModalAnalysis, file: Path) -> None:
    from matplotlib.figure import Figure

    shown = min(analysis.frequency.size, MOST_SHAPES)
    columns = 1 if len(analysis.measured.outputs) > 24 or shown == 1 else 2
    rows = -(-shown // columns)
    figure = Figure(figsize=(12.0, 2.8 * rows), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for mode, ax in enumerate(grid, start=1):
        if mode <= shown:
            plot_shape(analysis, mode, ax=ax)
        else:
            ax.remove()
    _save(figure, file)


def _save(figure: "Figure", file: Path) -> None:
    figure.savefig(file, dpi=130)
