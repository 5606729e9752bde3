"""A modal analysis of a file of measured responses, written down: tables, shapes and pictures."""

import dataclasses
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fitting.identification.modal_analysis import modal_analysis
from fitting.identification.modal_result import ModalAnalysis
from twin.frf import FRF
from twin.io.frf_uff import read_frf_uff, read_largest_frf_uff
from twin.io.modes_uff import write_modes_uff

# Responses and shapes of which pictures are drawn.
_RESPONSES, _SHAPES = 4, 24


def analyse_file(
    path: str | os.PathLike[str] | FRF,
    out: Path,
    *,
    band: tuple[float, float] | None = None,
    order: int | None = None,
    modes: int | Sequence[float] | None = None,
    outputs: tuple[str, ...] | None = None,
    inputs: tuple[str, ...] | None = None,
    form: str | None = None,
    damping: str = "viscous",
    reciprocal: bool | None = None,
) -> tuple[str, dict[str, Any]]:
    """Modes from a file of measured frequency responses, written into a folder.

    Writes `modes.toml`, `modes.csv`, `shapes.csv`, `shapes.uff` (where rows are named by node and direction),
    `stabilisation.png`, `responses.png`, `mac.png` and `shapes.png`.

    Args:
        path: universal file with datasets 58, or responses read by other means.
        out: folder; made if it does not exist.
        band: lowest and highest frequency used [Hz]; all if not given.
        order: highest order, as in `modal_analysis`.
        modes: how many modes, or about which frequencies [Hz]; found by itself if not given.
        outputs: responses used; all of the file if not given.
        inputs: excitations used; all of the file if not given.
        form: receptance, mobility or accelerance, where the responses do not say it themselves.
        damping: "viscous" or "hysteretic".
        reciprocal: whether excitations and responses are swapped, as in `modal_analysis`.

    Returns:
        Table for the reader, and a summary that JSON can hold.

    Raises:
        InputError: a file that cannot be used, whatever `modal_analysis` refuses.
    """
    gaps: list[str] = []
    if isinstance(path, FRF):
        frf, source = path, "responses given"
    else:
        source = Path(path).name
        if outputs is None and inputs is None:
            frf, gaps = read_largest_frf_uff(path)
        else:
            frf = read_frf_uff(path, outputs=outputs, inputs=inputs)
    analysis = modal_analysis(
        frf, band=band, order=order, modes=modes, form=form, damping=damping, reciprocal=reciprocal
    )
    analysis = dataclasses.replace(analysis, remarks=(*gaps, *analysis.remarks))
    out.mkdir(parents=True, exist_ok=True)
    summary = summarise(analysis, source)
    _write_toml(analysis, summary, out / "modes.toml")
    analysis.to_dataframe().to_csv(out / "modes.csv")
    _write_shapes(analysis, out)
    _plot(analysis, out)
    return f"Modes of {source}\n{analysis!r}\nResults in {out}", summary


def summarise(analysis: ModalAnalysis, source: str) -> dict[str, Any]:
    """What is known of the modes, as plain numbers.

    Args:
        analysis: the analysis.
        source: where the responses come from.
    """
    rows = zip(
        analysis.frequency,
        analysis.frequency_error,
        analysis.damping_ratio,
        analysis.damping_error,
        analysis.phase_collinearity,
        analysis.share,
        analysis.verdict,
        strict=True,
    )
    names = ("frequency", "frequency_error", "damping_ratio", "damping_error", "phase_collinearity", "share")
    return {
        "source": source,
        "converged": analysis.success,
        "message": analysis.message,
        "band": [float(analysis.measured.frequency[0]), float(analysis.measured.frequency[-1])],
        "form": analysis.measured.form,
        "reciprocal": analysis.reciprocal,
        "outputs": list(analysis.measured.outputs),
        "inputs": list(analysis.measured.inputs),
        "mass_normalised": analysis.mass_normalised,
        "error": analysis.error,
        "modes": [
            {**{name: float(value) for name, value in zip(names, row[:-1], strict=True)}, "verdict": row[-1]}
            for row in rows
        ],
        "remarks": list(analysis.remarks),
    }


def _write_toml(analysis: ModalAnalysis, summary: dict[str, Any], file: Path) -> None:
    import tomlkit

    document = tomlkit.document()
    document.add(tomlkit.comment("Modes from measured frequency responses. Frequencies in Hz, damping ratios plain."))
    for key in (
        "source",
        "converged",
        "band",
        "form",
        "reciprocal",
        "inputs",
        "outputs",
        "mass_normalised",
        "error",
        "remarks",
    ):
        document.add(key, summary[key])
    shapes = analysis.to_modes().output_shapes
    table = tomlkit.aot()
    for i, mode in enumerate(summary["modes"]):
        one = tomlkit.table()
        for key, value in mode.items():
            one.add(key, value)
        one.add("shape", [float(x) for x in np.asarray(shapes[:, i])])
        table.append(one)
    document.add("mode", table)
    file.write_text(tomlkit.dumps(document), encoding="utf-8")


def _write_shapes(analysis: ModalAnalysis, out: Path) -> None:
    from twin._input_error import InputError

    shapes = analysis.shapes_dataframe()
    parts = {}
    for i, name in enumerate(shapes.columns):
        column = shapes.iloc[:, i].to_numpy()
        number = f"mode {i + 1} ({name})"
        parts |= {f"{number} real": column.real, f"{number} imaginary": column.imag}
        parts[f"{number} ±"] = analysis.shape_errors[:, i]
    import pandas as pd

    pd.DataFrame(parts, index=shapes.index).to_csv(out / "shapes.csv")
    try:
        write_modes_uff(out / "shapes.uff", analysis.to_modes(), mass_normalised=analysis.mass_normalised)
    except InputError:
        return  # rows without node and direction; the tables have everything


def _plot(analysis: ModalAnalysis, out: Path) -> None:
    from matplotlib.figure import Figure

    from fitting.plots_modal import plot_mac, plot_shape, plot_stabilisation, plot_synthesis

    def save(figure: Figure, name: str) -> None:
        figure.savefig(out / name, dpi=130)

    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    plot_stabilisation(analysis, ax=figure.subplots())
    save(figure, "stabilisation.png")

    chosen = _responses(analysis.measured)
    figure = Figure(figsize=(8.0 * min(len(chosen), 2), 4.6 * -(-len(chosen) // 2)), layout="constrained")
    panels = np.asarray(figure.subfigures(-(-len(chosen) // 2), min(len(chosen), 2), squeeze=False)).ravel()
    for panel, (response, excitation) in zip(panels, chosen, strict=False):
        axes = panel.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        plot_synthesis(analysis, response, excitation, axes=axes)
    save(figure, "responses.png")

    count = analysis.frequency.size
    labels = [f"{f:.4g} Hz" for f in analysis.frequency]
    figure = Figure(figsize=(2.8 + 0.34 * count, 2.0 + 0.34 * count), layout="constrained")
    plot_mac(analysis.shapes, labels=(labels, labels), ax=figure.subplots())
    save(figure, "mac.png")

    shown = min(count, _SHAPES)
    columns = 1 if len(analysis.measured.outputs) > 24 else 2
    rows = -(-shown // columns)
    figure = Figure(figsize=(12.0, 2.8 * rows), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for mode, ax in enumerate(grid, start=1):
        if mode <= shown:
            plot_shape(analysis, mode, ax=ax)
        else:
            ax.remove()
    save(figure, "shapes.png")


def _responses(frf: FRF) -> list[tuple[str, str]]:
    """The driving points first, then the largest responses."""
    size = np.sum(np.abs(np.asarray(frf.values)) ** 2, axis=-1)
    ranked = [(frf.outputs[i], frf.inputs[j]) for i, j in np.argwhere(size >= 0)[np.argsort(-size.ravel())]]
    return sorted(ranked, key=lambda pair: pair[0] != pair[1])[:_RESPONSES]
