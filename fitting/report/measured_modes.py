"""The report of a modal analysis of measured responses."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from fitting.identification.modal_pictures import MOST_SHAPES, drawn_responses, mac_tells
from fitting.identification.modal_result import ModalAnalysis, counted
from fitting.plots_modal import plot_shape, plot_stabilisation, plot_synthesis
from fitting.report.asked import Asked, asked_section
from fitting.report.content import Cell, Figure, Report, Section, Table, number_cells
from fitting.report.numbers import given, percent, plain, together
from fitting.report.thinning import thinned
from twin.correlation import mac

_UNITS = {"receptance": "m/N", "mobility": "m/(Ns)", "accelerance": "m/(Ns²)", "ratio": "-"}


def measured_modes_report(analysis: ModalAnalysis, summary: Mapping[str, Any]) -> Report:
    """The report: what was asked, the responses, the modes with intervals, how well they explain the responses.

    Args:
        analysis: the analysis.
        summary: its summary, with what was asked, versions and checksums.
    """
    outputs, inputs, lines = analysis.measured.values.shape
    if analysis.reciprocal:
        outputs, inputs = inputs, outputs
    return Report(
        f"Modes of {summary['source']}",
        _asked(analysis, summary),
        warnings=_warnings(analysis),
        sections=(
            _modes(analysis),
            _stabilisation(analysis),
            _shapes(analysis),
            *((_mac(analysis),) if mac_tells(analysis) else ()),
            _synthesis(analysis),
            _channels(analysis),
        ),
        facts=(
            ("Modes", str(analysis.frequency.size)),
            ("Responses x excitations", f"{outputs} x {inputs}"),
            ("Lines", str(lines)),
            ("Not explained, rms", percent(analysis.error)),
            ("Shapes", "mass-normalised" if analysis.mass_normalised else "of unknown scale"),
        ),
    )


def _asked(analysis: ModalAnalysis, summary: Mapping[str, Any]) -> Section:
    asked, data = summary["asked"], summary["data"].get("responses", {})
    wanted = asked["modes"]
    low, high = (given(float(end)) for end in summary["band"])
    settings = {
        "File": summary["source"],
        "SHA-256": data.get("sha256", ""),
        "Band": f"{low} to {high} Hz" + (", all lines" if asked["band"] is None else ""),
        "Quantity": analysis.measured.form,
        "Damping": asked["damping"],
        "Highest order": str(analysis.diagram.orders),
        "Modes wanted": "those found"
        if wanted is None
        else str(wanted)
        if isinstance(wanted, int)
        else ", ".join(f"{given(one)} Hz" for one in wanted),
    }
    task = "Natural frequencies, damping ratios and shapes from measured frequency responses."
    return asked_section(Asked(task, versions=summary["versions"], settings=settings))


def _warnings(analysis: ModalAnalysis) -> tuple[str, ...]:
    doubtful = [
        f"{plain(float(f), 5)} Hz ({told})"
        for f, told in zip(analysis.frequency, analysis.verdict, strict=True)
        if told != "good"
    ]
    return (
        *(() if analysis.success else (f"The fit did not converge. {analysis.fit.message}",)),
        *analysis.warnings,
        *((f"Modes to be taken with care: {'; '.join(doubtful)}.",) if doubtful else ()),
    )


def _modes(analysis: ModalAnalysis) -> Section:
    head = ("Mode", "Frequency [Hz]", "95 % interval [Hz]", "Damping [%]", "95 % interval [%]", "Verdict")
    more = ("Mode", "Standard error [Hz]", "of damping [%]", "Phase collinearity", "Share", "Largest at")
    frequency, ratio = analysis.intervals
    rows, kinds = [], []
    for i, verdict in enumerate(analysis.verdict):
        error, spread = float(analysis.frequency_error[i]), 100 * float(analysis.damping_error[i])
        numbers = (
            together((float(analysis.frequency[i]),), error, "{}"),
            together(tuple(map(float, frequency[i])), error, "{} … {}"),
            together((100 * float(analysis.damping_ratio[i]),), spread, "{}"),
            together(tuple(100 * float(x) for x in ratio[i]), spread, "{} … {}"),
        )
        largest = analysis.measured.outputs[int(np.argmax(np.abs(analysis.shapes[:, i])))]
        told = (plain(error, 2), plain(spread, 2), f"{analysis.phase_collinearity[i]:.3f}")
        told += (percent(float(analysis.share[i])),)
        kinds.append((Cell(str(i + 1)), *number_cells(told), Cell(largest, "name")))
        rows.append((Cell(str(i + 1)), *number_cells(numbers), Cell(verdict, "good" if verdict == "good" else "bad")))
    return Section(
        "Modes",
        text="The share of a mode is the power of its own responses over that of all; shares of modes "
        "that work against each other add up to more than 100 %.",
        tables=(Table(head, tuple(rows), "Modes"), Table(more, tuple(kinds), "Standard errors, shapes and size")),
        remarks=analysis.remarks,
    )


def _stabilisation(analysis: ModalAnalysis) -> Section:
    def draw(axes: np.ndarray) -> None:
        plot_stabilisation(analysis, ax=axes[0])

    return Section(
        "Stabilisation diagram",
        text="Poles of rising orders over the mode indicator function. Poles of the structure stay where they are; "
        "those of noise wander.",
        figures=(
            Figure(
                draw,
                f"Poles over frequency for orders up to {analysis.diagram.orders}, the modes taken as lines",
                wide=True,
                height=4.2,
            ),
        ),
    )


def _synthesis(analysis: ModalAnalysis) -> Section:
    chosen = drawn_responses(analysis)
    every = len(analysis.measured.outputs) * len(analysis.measured.inputs)
    figures = tuple(
        Figure(
            partial(_draw_synthesis, analysis, *pair),
            f"Magnitude and phase of {_pair(analysis, *pair)}, measured and synthesised",
            f"{_pair(analysis, *pair)}: {percent(_unexplained(analysis, *pair))} not explained (rms).",
            panels=2,
            height=1.7,
            wide=every == 1,
        )
        for pair in chosen
    )
    hidden = every - len(chosen)
    return Section(
        "Measured against synthesised responses",
        figures=figures,
        remarks=(f"Drawn are {len(chosen)} of {every} responses, driving points and the largest first.",)
        if hidden
        else (),
    )


def _draw_synthesis(analysis: ModalAnalysis, response: str, excitation: str, axes: np.ndarray) -> None:
    plot_synthesis(analysis, response, excitation, axes=axes)
    for ax in axes:
        for line in ax.lines:
            x, y = (np.asarray(values, dtype=float) for values in line.get_data())
            if x.size > 2:
                kept = thinned(ax, y)
                line.set_data(x[kept], y[kept])
    axes[0].set_ylabel(f"[{_UNITS[analysis.measured.form]}]")


def _pair(analysis: ModalAnalysis, response: str, excitation: str) -> str:
    if analysis.reciprocal:
        response, excitation = excitation, response
    return f"{response} / force {excitation}"


def _unexplained(analysis: ModalAnalysis, response: str, excitation: str) -> float:
    measured = np.asarray(analysis.measured[response, excitation])
    size = float(np.linalg.norm(measured))
    return (
        float(np.linalg.norm(measured - np.asarray(analysis.synthesised[response, excitation]))) / size if size else 0.0
    )


def _shapes(analysis: ModalAnalysis) -> Section:
    shown = min(analysis.frequency.size, MOST_SHAPES)
    points = len(analysis.measured.outputs)

    def draw(mode: int, axes: np.ndarray) -> None:
        plot_shape(analysis, mode, ax=axes[0]).set_title("", loc="left")

    figures = tuple(
        Figure(
            partial(draw, mode),
            f"Shape of mode {mode} at {counted(points, 'point')}",
            f"Mode {mode}: {plain(float(f), 5)} Hz, damping {percent(float(d))}.",
            wide=points > 20,
            height=2.5,
        )
        for mode, f, d in zip(range(1, shown + 1), analysis.frequency, analysis.damping_ratio, strict=False)
    )
    scale = "mass-normalised" if analysis.mass_normalised else "over their largest entry, for want of a driving point"
    return Section("Shapes", text=f"Shapes are {scale}. Bars are two standard errors.", figures=figures)


def _mac(analysis: ModalAnalysis) -> Section:
    values = np.asarray(mac(analysis.shapes, analysis.shapes))
    names = [f"{f:.4g} Hz" for f in analysis.frequency]
    rows = tuple(
        (Cell(name, "name"), *(Cell(f"{value:.2f}", tint=-float(value)) for value in row))
        for name, row in zip(names, values, strict=True)
    )
    return Section(
        "Likeness of the shapes (MAC)",
        text="1 for shapes that are alike, 0 for those that have nothing in common. Different modes that are alike "
        "call for more points, or are one mode found twice.",
        tables=(Table(("", *names), rows, "MAC [-]", map=True),),
    )


def _channels(analysis: ModalAnalysis) -> Section:
    frf = analysis.measured
    frequency = np.asarray(frf.frequency)
    rows = []
    for output in frf.outputs:
        for excitation in frf.inputs:
            size = np.abs(np.asarray(frf[output, excitation]))
            at = int(np.argmax(size))
            numbers = (plain(float(size[at])), plain(float(frequency[at]), 5), plain(float(np.median(size))))
            told = percent(_unexplained(analysis, output, excitation))
            rows.append((Cell(_pair(analysis, output, excitation), "name"), *number_cells((*numbers, told))))
    unit = _UNITS[frf.form]
    head = ("Response / excitation", f"Largest [{unit}]", "at [Hz]", f"Median [{unit}]", "Not explained")
    return Section(
        "Responses at a glance",
        text=f"{counted(frequency.size, 'line')} from {frequency[0]:g} to {frequency[-1]:g} Hz.",
        tables=(Table(head, tuple(rows), "Responses"),),
    )
