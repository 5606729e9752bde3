"""Section: the parameters."""

from collections.abc import Mapping

import numpy as np

from fitting.identifiability import IDENTIFIED, IdentifiabilityReport
from fitting.report.content import Bar, Cell, Section, Table
from fitting.report.numbers import given, plain, together, with_error
from fitting.result import Estimate, FitResult

# A line may end before it, not after.
_TOGETHER = "±\u00a0"


def parameters_section(
    result: FitResult,
    identifiability: IdentifiabilityReport | None = None,
    derived: Mapping[str, Estimate] | None = None,
) -> Section:
    """Estimates with standard errors, intervals, their place within the bounds, and what the data say about each.

    Args:
        result: the fit.
        identifiability: verdicts on its parameters, if there are any.
        derived: quantities that follow from the parameters, by name.
    """
    low, high = result.intervals().T
    errors = result.standard_errors
    rows = []
    for i, p in enumerate(result.space.parameters):
        value, error = float(result.values[i]), float(errors[i])
        ends = (float(low[i]), float(high[i]))
        known = bool(np.all(np.isfinite(ends)))
        rows.append(
            (
                Cell(p.path, "name"),
                Cell(with_error(value, error).replace("± ", _TOGETHER), "number"),
                Cell(p.unit or "–", "unit"),
                Cell(together(ends, error, "{} … {}") if known else "–", "number"),
                _bar(result, i),
                _verdict(result, i, identifiability),
            )
        )
    head = ("Parameter", "Estimate ± standard error", "Unit", "95 % interval", "Between its bounds", "Verdict")
    tables = [Table(head, tuple(rows), "Estimates")]
    if derived:
        cells = [
            (Cell(name), Cell(with_error(one.value, one.standard_error), "number"), Cell(one.unit, "unit"))
            for name, one in derived.items()
        ]
        tables.append(Table(("Quantity", "Value ± standard error", "Unit"), tuple(cells), "What follows from them"))
    remarks = [result.message]
    if identifiability is not None:
        remarks.append(identifiability.message)
    return Section(
        "Parameters",
        text="The bar is the way from the lower to the upper bound on the parameter's scale, the dot the estimate, the "
        f"band its 95 % interval. {_errors_told(result)}",
        tables=tuple(tables),
        remarks=tuple(remarks),
    )


def _errors_told(result: FitResult) -> str:
    """Which kind of standard error is shown."""
    if result.variance == "known":
        return "Standard errors by the standard deviations of the data as they were given."
    if result.correlated:
        return "Standard errors allow for errors that hang together from sample to sample."
    return "Standard errors count errors as independent from sample to sample."


def _bar(result: FitResult, i: int) -> Cell:
    parameter = result.space.parameters[i]
    lower, upper = (float(parameter.to_scaled(bound)) for bound in (parameter.lower, parameter.upper))
    words = f"{plain(float(result.values[i]))} between {given(parameter.lower)} and {given(parameter.upper)}"
    if not (np.isfinite(lower) and np.isfinite(upper)):
        return Cell("not bounded")
    interval = result.intervals()[i]
    ends = [float(parameter.to_scaled(end)) if np.isfinite(end) else float("nan") for end in interval]
    at, low, high = (
        float(np.clip((x - lower) / (upper - lower), 0.0, 1.0)) if np.isfinite(x) else None
        for x in (float(result.scaled[i]), *ends)
    )
    at = 0.5 if at is None else at
    return Cell(words, bar=Bar(at, at if low is None else low, at if high is None else high, words))


def _verdict(result: FitResult, i: int, report: IdentifiabilityReport | None) -> Cell:
    if report is not None:
        verdict = report[result.space.paths[i]]
        if verdict.kind == IDENTIFIED and result.active.any():
            return Cell(f"{verdict.sentence}, what is at a bound held there")
        return Cell(verdict.sentence, "good" if verdict.kind == IDENTIFIED else "bad")
    if result.active[i]:
        return Cell("at a bound", "bad")
    return Cell("not determined", "bad") if result.unseen[i] else Cell("–")
