"""Section: what was asked."""

import dataclasses
from collections.abc import Mapping

from fitting.report.content import Cell, Folded, Section, Table
from fitting.report.numbers import given
from twin.parameters import Parameter, ParameterSpace


@dataclasses.dataclass(frozen=True)
class Asked:
    """What was asked, in the words of the one who asked."""

    text: str = ""
    """The task in a sentence or two."""
    model: str = ""
    """What the model is."""
    study: str = ""
    """The study file as it is; shown folded."""
    versions: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """Versions of what computed, by name."""
    settings: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """Other settings by name, such as the solver or a seed."""


def asked_section(asked: Asked, space: ParameterSpace | None = None) -> Section:
    """What was asked: model, settings, free parameters with bounds and priors, versions, the study file.

    Args:
        asked: the task.
        space: free parameters, if any.
    """
    lines = {
        "Model": asked.model,
        **asked.settings,
        "Versions": ", ".join(f"{k} {v}" for k, v in asked.versions.items()),
    }
    rows = tuple((Cell(name), Cell(value)) for name, value in lines.items() if value)
    tables = [Table(("", ""), rows)] if rows else []
    if space is not None:
        tables.append(_free(space))
    folded = (Folded("Study file", asked.study),) if asked.study else ()
    return Section("What was asked", text=asked.text, tables=tuple(tables), folded=folded)


def _free(space: ParameterSpace) -> Table:
    priors = any(p.prior for p in space.parameters)
    tied = any(p.tied for p in space.parameters)
    head = ["Free parameter", "Unit", "From", "To", "Scale"] + ["Prior"] * priors + ["Also sets"] * tied
    rows = []
    for p in space.parameters:
        row = [
            Cell(p.path, "name"),
            Cell(p.unit or "–", "unit"),
            Cell(given(p.lower), "number"),
            Cell(given(p.upper), "number"),
        ]
        row.append(Cell(p.scale))
        if priors:
            row.append(Cell(_prior(p), "number"))
        if tied:
            row.append(Cell(", ".join(p.tied), "name"))
        rows.append(tuple(row))
    return Table(tuple(head), tuple(rows), "Free parameters and their bounds")


def _prior(parameter: Parameter) -> str:
    if parameter.prior is None:
        return "–"
    mean, deviation = parameter.prior
    return f"{given(mean)} ± {given(deviation)}"
