"""`drivetwin modes`: natural frequencies and damping ratios of the model of a study.

[modes]
velocity = "0.1 m/s"         # friction counts by its slope at this speed
preload = "5 N m"            # of a drive with two motors
"""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fitting.commands._outcome import Outcome
from fitting.report.content import Cell, Section, Table
from fitting.report.numbers import plain, together, with_error
from fitting.result import FitResult
from fitting.study.fitted_spread import FITTED, RESULT, fit_beside, spread
from fitting.study.model_modes import elastic_modes
from fitting.study.operating_point import KEYS, operating_point
from fitting.study.run_report import write_run_report
from fitting.study.study_file import StudyFile
from fitting.study.written import write_run
from twin._checks import InputError

_HEADINGS = (
    "natural frequency [Hz]",
    "standard error [Hz]",
    "damped frequency [Hz]",
    "damping ratio [-]",
    "standard error of damping ratio [-]",
)


class VibrationMode(NamedTuple):
    """One vibration of a model."""

    frequency_Hz: float
    """Undamped natural frequency."""
    frequency_error_Hz: float
    """Its standard error; NaN where it is not known."""
    damped_frequency_Hz: float
    """Frequency of free vibration."""
    damping_ratio: float
    """Damping ratio [-]."""
    damping_ratio_error: float
    """Its standard error [-]; NaN where it is not known."""

    def written(self) -> tuple[str, str, str]:
        """Natural frequency, damped frequency [Hz] and damping ratio [%] as text."""
        if np.isnan(self.frequency_error_Hz):
            return plain(self.frequency_Hz, 6), plain(self.damped_frequency_Hz, 6), plain(100 * self.damping_ratio)
        return (
            with_error(self.frequency_Hz, self.frequency_error_Hz),
            together((self.damped_frequency_Hz,), self.frequency_error_Hz, "{}"),
            with_error(100 * self.damping_ratio, 100 * self.damping_ratio_error),
        )


def run_modes(study: StudyFile, out: Path) -> Outcome:
    """Compute the modes, and write `modes.csv` and `summary.json`.

    Args:
        study: the study.
        out: folder for the results.

    Raises:
        InputError: a model that has no modes.
    """
    table = study.table("modes", known=KEYS)
    try:
        found = elastic_modes(study.model, operating_point(table, study.model))
    except InputError as error:
        raise table.error("", str(error)) from error
    kept = np.isfinite(np.asarray(found.frequency))
    frequency, ratio = (np.asarray(x)[kept] for x in found)
    fit = fit_beside(study)
    frequency_error, ratio_error = np.full((2, frequency.size), np.nan)
    if fit is not None:

        def modes(model: Any) -> np.ndarray:
            return np.stack([np.asarray(x)[kept] for x in elastic_modes(model, operating_point(table, model))])

        frequency_error, ratio_error = spread(modes, fit)
    damped = frequency * np.sqrt(np.maximum(1 - ratio**2, 0.0))
    rows = [
        VibrationMode(*(float(x) for x in row))
        for row in zip(frequency, frequency_error, damped, ratio, ratio_error, strict=True)
    ]
    lines = ["mode," + ",".join(_HEADINGS), *(f"{i + 1}," + ",".join(map(repr, row)) for i, row in enumerate(rows))]
    (out / "modes.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    summary = {"modes": [row._asdict() for row in rows], "errors_from": None if fit is None else RESULT}
    write_run(study, out, "modes", summary)
    cells = [
        (Cell(str(i + 1), "number"), *(Cell(one, "number") for one in row.written())) for i, row in enumerate(rows)
    ]
    heads = ("Mode", "Natural frequency, undamped [Hz]", "Damped [Hz]", "Damping ratio [%]")
    listed = Table(heads, tuple(cells))
    section = Section(
        "Modes", "Vibrations of the model in motion.", tables=(listed,) if rows else (), remarks=(_source(fit),)
    )
    report = write_run_report(study, out, "Natural frequencies and damping ratios of the model.", [section])
    told = [
        f"{i + 1:4}  {row.written()[0]:>24}  {row.written()[1]:>12}  {row.written()[2]:>20}"
        for i, row in enumerate(rows)
    ]
    head = [f"mode  {'natural frequency [Hz]':>24}  {'damped [Hz]':>12}  {'damping ratio [%]':>20}"]
    told = [*head, *told] if rows else ["The model has no vibration: it is rigid, or overdamped."]
    return Outcome("\n".join([f"{study.title}: modes", *told, _source(fit), f"Report: {report}"]), summary)


def _source(fit: FitResult | None) -> str:
    if fit is None:
        return (
            "The values are those of the study file, as they stand there; fitted ones, with their errors, are in "
            f"{FITTED} of a fit's folder."
        )
    told = "Standard errors follow from those of the fit."
    return told if fit.success else f"{told} That did not converge: they hold only with care."
