"""The report of a run that is no fit: what was asked, and what came out."""

from collections.abc import Sequence
from pathlib import Path

from fitting.provenance import versions
from fitting.report.asked import Asked, asked_section
from fitting.report.content import Report, Section
from fitting.report.page import write_report
from fitting.study.study_file import StudyFile
from twin.parameters import ParameterSpace


def write_run_report(
    study: StudyFile,
    out: Path,
    task: str,
    sections: Sequence[Section],
    *,
    warnings: Sequence[str] = (),
    facts: Sequence[tuple[str, str]] = (),
    space: ParameterSpace | None = None,
) -> Path:
    """Write `report.html`.

    Args:
        study: the study.
        out: folder for the results.
        task: what was asked, in a sentence.
        sections: what came out.
        warnings: what the reader must know first.
        facts: numbers for the head of the page, by name.
        space: free parameters, where they matter.

    Returns:
        Path of the report.
    """
    asked = Asked(task, type(study.model).__name__, study.document.text, versions(), {"Seed": str(study.seed)})
    report = Report(study.title, asked_section(asked, space), tuple(warnings), tuple(sections), tuple(facts))
    return write_report(out / "report.html", report)
