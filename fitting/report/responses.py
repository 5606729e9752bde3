"""Sections: frequency responses, at a glance and against the fit."""

from collections.abc import Mapping
from functools import partial

import numpy as np

from fitting.plots_frequency import plot_magnitude, plot_phase
from fitting.report.content import Cell, Figure, Section, Table, number_cells
from fitting.report.numbers import given, percent
from twin.frf import FRF

_MOST = 12
_MEASURED, _MODEL = {"color": "0.55", "markersize": 3.0}, {"color": "C0", "linewidth": 1.1}


def responses_section(
    responses: Mapping[str, FRF], simulated: Mapping[str, FRF] | None = None, units: Mapping[str, str] | None = None
) -> Section:
    """Measured frequency responses at a glance, or against those of the fitted model: magnitude and phase.

    Args:
        responses: measured responses by name.
        simulated: responses of the model by the same names, with the same names of outputs and inputs.
        units: unit of output per input by name of the response; "1" if not given.
    """
    against = simulated is not None
    rows, figures = [], []
    for name, frf in responses.items():
        model = (simulated or {}).get(name)
        for output, excitation in [(o, i) for o in frf.outputs for i in frf.inputs]:
            frequency = np.asarray(frf.frequency)
            numbers = [
                str(frequency.size),
                given(float(frequency[0])),
                given(float(frequency[-1])),
                _noise(frf, output, excitation),
            ]
            if against:
                numbers.append("–" if model is None else _error(frf, model, output, excitation))
            rows.append((Cell(name), Cell(f"{output} / {excitation}", "name"), *number_cells(numbers)))
            unit = (units or {}).get(name, "1")
            figures.append(_figure(name, frf, model, output, excitation, unit))
    head = ("Response", "Output / input", "Lines", "From [Hz]", "To [Hz]", "Noise") + ("Relative error",) * against
    hidden = len(figures) - _MOST
    return Section(
        "Frequency responses: fit against measurement" if against else "Frequency responses at a glance",
        text="Noise is the standard deviation over the magnitude, at the median line.",
        figures=tuple(figures[:_MOST]),
        tables=(Table(head, tuple(rows), "Frequency responses"),),
        remarks=(f"Only the first {_MOST} of {len(figures)} responses are drawn.",) if hidden > 0 else (),
    )


def _noise(frf: FRF, output: str, excitation: str) -> str:
    if frf.variance is None:
        return "–"
    share = np.asarray(frf.standard_deviation(output, excitation)) / np.abs(np.asarray(frf[output, excitation]))
    return percent(float(np.median(share)))


def _error(frf: FRF, model: FRF, output: str, excitation: str) -> str:
    """‖G - Ĝ‖/‖Ĝ‖ at the measured lines, the model's response between its own ones."""
    measured, values = np.asarray(frf[output, excitation]), np.asarray(model[output, excitation])
    there = np.interp(np.asarray(frf.frequency), np.asarray(model.frequency), values)
    return percent(float(np.linalg.norm(there - measured) / np.linalg.norm(measured)))


def _figure(name: str, frf: FRF, model: FRF | None, output: str, excitation: str, unit: str) -> Figure:
    what = "measured" if model is None else "measured and simulated"
    return Figure(
        partial(_draw, frf, model, output, excitation, unit),
        f"Magnitude and phase of {output} / {excitation}, {what}, response {name}",
        f"{name}: {output} / {excitation}, {what}.",
        panels=2,
        wide=len(frf.outputs) * len(frf.inputs) == 1,
        height=1.9,
    )


def _draw(frf: FRF, model: FRF | None, output: str, excitation: str, unit: str, axes: np.ndarray) -> None:
    magnitude, phase = axes
    plot_magnitude(frf, output, excitation, model=model, unit=unit, ax=magnitude)
    plot_phase(frf, output, excitation, model=model, ax=phase)
    for ax in axes:
        for line in ax.lines:
            line.set(**(_MEASURED if line.get_label() == "measured" else _MODEL))
        ax.legend()
    magnitude.set_xlabel("")
    magnitude.set_ylabel(f"magnitude [{unit}]")
    phase.set_ylabel("phase [°]")
    legend = phase.get_legend()
    if legend is not None:
        legend.remove()
