"""`drivetwin identify`: parameters by a named procedure."""

import importlib
import pkgutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fitting.commands._outcome import Outcome
from fitting.provenance import versions
from fitting.report.asked import Asked
from fitting.report.fit_report import fit_report
from fitting.report.page import write_report
from fitting.result import FitResult
from fitting.study import procedures
from fitting.study.procedures._found import Found
from fitting.study.study_file import StudyFile
from fitting.study.written import write_run
from twin._checks import InputError
from twin.io.toml_document import unknown


def known_procedures() -> dict[str, Any]:
    """The procedures by name."""
    names = [found.name for found in pkgutil.iter_modules(procedures.__path__) if not found.name.startswith("_")]
    return {name: importlib.import_module(f"{procedures.__name__}.{name}") for name in sorted(names)}


def run_identify(study: StudyFile, out: Path) -> Outcome:
    """Run the procedure that [identify] names, and write `summary.json`, and `report.html` where it is a fit.

    Args:
        study: the study.
        out: folder for the results.

    Raises:
        InputError: naming line and key: an unknown procedure, data that it cannot use.
    """
    known = known_procedures()
    all_keys = {key for one in known.values() for key in one.KEYS}
    name = study.table("identify", known=("procedure", *all_keys), required=True).text("procedure")
    if name not in known:
        told = "; ".join(f"{one} ({module.HELP})" for one, module in known.items())
        raise study.document.error(("identify", "procedure"), f"{unknown('procedure', name, known)} They are: {told}.")
    procedure = known[name]
    table = study.table("identify", known=("procedure", *procedure.KEYS))
    try:
        found = procedure.run(study, table, out)
    except InputError as error:
        if str(study.document.file) in str(error):
            raise
        raise table.error("procedure", f"{name}: {error}") from error
    text = f"{study.title}: {procedure.HELP}\n{found.text}"
    if found.result is None:
        return Outcome(f"{text}\nResults in {out}", write_run(study, out, "identify", _summary(name, found, ())))
    report = fit_report(
        title=study.title,
        asked=Asked(f"{name}: {procedure.HELP}.", "", study.document.text, versions(), {"Procedure": name}),
        result=found.result,
        responses=found.responses,
        records=found.records,
        identifiability=found.verdicts,
        many=found.many,
        controls=found.controls,
        series=found.series,
        derived=found.derived,
        remarks=found.remarks,
    )
    found.result.save(out / "fit.npz")
    page = write_report(out / "report.html", report)
    whole = write_run(study, out, "identify", _summary(name, found, report.warnings))
    told = [text, *(f"Warning: {warning}" for warning in report.warnings), f"Report: {page}"]
    return Outcome("\n".join(told), whole, code=0 if _trusted(found.result, found) else 1)


def _summary(name: str, found: Found, warnings: Sequence[str]) -> dict[str, Any]:
    return {"procedure": name, **found.summary, "warnings": list(warnings)}


def _trusted(result: FitResult, found: Found) -> bool:
    """Whether a result may be used: converged, not held by its bounds alone, and no control failed."""
    return result.success and not result.active.all() and all(control.passed for control in found.controls)
