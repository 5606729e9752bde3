"""`drivetwin modes`: natural frequencies and damping ratios of the model of a study.

[modes]
velocity = "0.1 m/s"         # friction counts by its slope at this speed
preload = "5 N m"            # of a drive with two motors
"""

from pathlib import Path

import numpy as np

from fitting.commands._outcome import Outcome
from fitting.report.content import Cell, Section, Table
from fitting.study.model_modes import elastic_modes
from fitting.study.operating_point import KEYS, operating_point
from fitting.study.run_report import write_run_report
from fitting.study.study_file import StudyFile
from fitting.study.written import write_run
from twin._checks import InputError


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
    rows = list(zip(*(np.asarray(x)[kept].tolist() for x in found), strict=True))
    lines = ["mode,frequency [Hz],damping ratio [-]", *(f"{i + 1},{f!r},{d!r}" for i, (f, d) in enumerate(rows))]
    (out / "modes.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    summary = {"modes": [{"frequency_Hz": f, "damping_ratio": d} for f, d in rows]}
    write_run(study, out, "modes", summary)
    cells = [
        (Cell(str(i + 1), "number"), Cell(f"{f:.5g}", "number"), Cell(f"{100 * d:.3g}", "number"))
        for i, (f, d) in enumerate(rows)
    ]
    listed = Table(("Mode", "Frequency [Hz]", "Damping ratio [%]"), tuple(cells))
    section = Section("Modes", "Vibrations of the model in motion.", tables=(listed,) if rows else ())
    report = write_run_report(study, out, "Natural frequencies and damping ratios of the model.", [section])
    told = [f"{i + 1:3}  {f:10.4f} Hz   damping {100 * d:7.3f} %" for i, (f, d) in enumerate(rows)]
    told = told or ["The model has no vibration: it is rigid, or overdamped."]
    return Outcome("\n".join([f"{study.title}: modes", *told, f"Report: {report}"]), summary)
