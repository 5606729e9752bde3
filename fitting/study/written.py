"""What every run of a study leaves behind: the study it was, the versions it ran with, a summary."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomlkit

from fitting.json_file import write_json
from fitting.provenance import checksum, versions
from fitting.study.study_file import StudyFile
from twin.parameters import ParameterSpace


def write_run(study: StudyFile, out: Path, command: str, summary: Mapping[str, Any]) -> dict[str, Any]:
    """Write `summary.json`, and `study.toml`, from which the run can be repeated.

    Args:
        study: the study.
        out: folder of the results.
        command: the command that ran.
        summary: what it found.

    Returns:
        The summary with title, versions and checksums of the data.
    """
    whole = {"title": study.title, "command": command, **summary, "versions": versions(), "data": _checksums(study)}
    write_json(out / "summary.json", whole)
    document = tomlkit.parse(study.document.text)
    _lead_back(document, study, out)
    head = f"# The study as `drivetwin {command}` ran it; repeat it by: drivetwin {command} study.toml --out DIR\n"
    (out / "study.toml").write_text(head + tomlkit.dumps(document), encoding="utf-8")
    return whole


def write_fitted(study: StudyFile, out: Path, space: ParameterSpace, values: Mapping[str, float]) -> Path:
    """Write `fitted.toml`: the study with the estimates in place of the values that it began with.

    Args:
        study: the study.
        out: folder of the results.
        space: the free parameters.
        values: estimates by path, SI.
    """
    document = tomlkit.parse(study.document.text)
    _lead_back(document, study, out)
    # A part that is like another would change with it.
    alike = "like" in study.document.text
    for parameter in space.parameters:
        for path in (parameter.path, *parameter.tied):
            value = values[parameter.path]
            written = f"{value!r} {parameter.unit}".strip() if parameter.unit not in ("", "1") else value
            if alike or not _replaced(document["model"], path.split("."), written):
                model: Any = document["model"]
                model.setdefault("set", tomlkit.inline_table())[path] = written
    file = out / "fitted.toml"
    file.write_text("# The study with fitted values.\n" + tomlkit.dumps(document), encoding="utf-8")
    return file


def _checksums(study: StudyFile) -> dict[str, dict[str, str]]:
    found = {}
    for name, entry in study.document.table(("data",)).items():
        file = study.document.folder / str(entry.get("file", "")) if isinstance(entry, dict) else Path()
        if file.is_file():
            found[name] = checksum(file)
    return found


def _lead_back(document: Any, study: StudyFile, out: Path) -> None:
    """Make the paths of the data lead there from the folder of the results."""
    for entry in document.get("data", {}).values():
        if isinstance(entry, dict) and "file" in entry and not Path(str(entry["file"])).is_absolute():
            there = (study.document.folder / str(entry["file"])).resolve()
            try:
                led = os.path.relpath(there, out.resolve())
            except ValueError:  # on another drive of Windows
                led = str(there)
            entry["file"] = Path(led).as_posix()


def _replaced(table: Any, names: list[str], written: Any) -> bool:
    for name in names[:-1]:
        if not isinstance(table, dict) or name not in table:
            return False
        table = table[name]
    if not isinstance(table, dict) or names[-1] not in table or isinstance(table[names[-1]], dict | list):
        return False
    table[names[-1]] = written
    return True
