"""`drivetwin identify`: parameters by a named procedure."""

import importlib
import pkgutil
from pathlib import Path
from typing import Any

from fitting.commands._outcome import Outcome
from fitting.report.asked import Asked
from fitting.report.fit_report import fit_report
from fitting.report.page import write_report
from fitting.study import procedures
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
    whole = write_run(study, out, "identify", {"procedure": name, **found.summary})
    text = f"{study.title}: {procedure.HELP}\n{found.text}"
    if found.result is None:
        return Outcome(f"{text}\nResults in {out}", whole)
    report = fit_report(
        title=study.title,
        asked=Asked(f"{name}: {procedure.HELP}.", "", study.document.text, whole["versions"], {"Procedure": name}),
        result=found.result,
        responses=found.responses,
        records=found.records,
        identifiability=found.verdicts,
        many=found.many,
        controls=found.controls,
    )
    found.result.save(out / "fit.npz")
    page = write_report(out / "report.html", report)
    return Outcome(f"{text}\nReport: {page}", whole, code=0 if found.result.success else 1)
