"""`drivetwin fit`: the free parameters of a study from its data.

[fit]
starts = 200                 # 1: from the values of the model alone
max_steps = 300              # of each start
hold_back = ["run2"]         # data sets that are predicted instead of fitted
controls = true              # predict what was held back, and fit shuffled data
correlated = true            # what is left over is a model error, not noise
loss = "squares"             # or "huber", against outliers
"""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from fitting.commands._outcome import Outcome
from fitting.controls import Control, held_back, held_back_share, permuted_control
from fitting.controls.relative_error import relative_error
from fitting.fit import fit
from fitting.identifiability import IdentifiabilityReport, identifiability
from fitting.multistart import MultistartResult, multistart
from fitting.provenance import versions
from fitting.residuals.residual import AbstractResidual
from fitting.result import FitResult
from fitting.study.derived import derived_of
from fitting.study.evidence import (
    FIT_KEYS,
    StudyData,
    evidence_of,
    read_data,
    simulate_record,
    status_of,
)
from fitting.study.fit_report import write_fit_report
from fitting.study.lowered_noise import lowered_noise
from fitting.study.shown import shown_derived, shown_estimates
from fitting.study.study_file import StudyFile
from fitting.study.timing import timing_hint
from fitting.study.written import write_fitted, write_run
from twin._checks import InputError
from twin.frf import FRF
from twin.io.parameter_file import ParameterEntry, write_parameters
from twin.io.toml_document import unknown

MAX_STEPS = 300
"""Steps after which a fit is given up, where the study does not say."""
# How often noise that was read from the records may turn out to be less.
_ROUNDS = 2


@dataclasses.dataclass(frozen=True)
class FitRun:
    """A fit of a study with all that belongs to it."""

    data: StudyData
    """All data, those held back too."""
    result: FitResult
    """The fit; its model is the fitted one."""
    many: MultistartResult | None
    """All starts, where there were several."""
    verdicts: IdentifiabilityReport
    """What the data can tell."""
    controls: tuple[Control, ...]
    """Controls that the fit was put to."""
    simulated: dict[str, dict[str, np.ndarray]]
    """What the fitted model does, by record and channel, at the record's times; NaN where it fails."""
    responses: dict[str, tuple[FRF, FRF]]
    """Measured and fitted frequency responses by data set."""
    problems: tuple[str, ...]
    """Simulations that did not succeed, each in a sentence."""
    held: tuple[str, ...]
    """Names of the data sets held back."""
    hints: tuple[str, ...] = ()
    """What the data would fit better with."""


def run_fit(study: StudyFile, out: Path) -> Outcome:
    """Fit, and write `parameters.toml`, `fitted.toml`, `fit.npz`, `summary.json`, `report.html` and pictures.

    Args:
        study: the study.
        out: folder for the results; a multi-start goes on from what is kept in `store` there.

    Raises:
        InputError: naming line and key, or the data file, that cannot be used.
    """
    found = fit_study(study, out)
    result = found.result
    values = dict(zip(result.space.paths, result.values.tolist(), strict=True))
    write_fitted(study, out, result.space, values)
    result.save(out / "fit.npz")
    write_parameters(out / "parameters.toml", _entries(result, study.title), header=f"{study.title}\n{result.message}")
    summary = summary_of(found)
    report, warnings = write_fit_report(study, found, out, versions=versions())
    summary["warnings"] = list(warnings)
    whole = write_run(study, out, "fit", summary)
    trusted = result.success and not found.problems and all(control.passed for control in found.controls)
    return Outcome(_text(study, found, summary, report), whole, code=0 if trusted else 1)


def _entries(result: FitResult, source: str) -> list[ParameterEntry]:
    found = []
    for parameter, value, error in zip(result.space.parameters, result.values, result.standard_errors, strict=True):
        unit, known = parameter.unit or "1", None if np.isnan(error) else float(error)
        found.append(
            ParameterEntry(parameter.path, float(value), unit, known, parameter.lower, parameter.upper, source)
        )
    return found


def fit_study(study: StudyFile, out: Path | None = None) -> FitRun:
    """Fit a study, and put the fit to its controls.

    Args:
        study: the study.
        out: folder in which a multi-start keeps what it has computed; None for nowhere.

    Raises:
        InputError: naming line and key, or the data file, that cannot be used.
    """
    table = study.table("fit", known=FIT_KEYS)
    data = read_data(study)
    names = [one.name for one in (*data.records, *data.responses)]
    held = table.texts("hold_back", ())
    for name in held:
        if name not in names:
            raise table.error("hold_back", unknown("data set", name, names))
    if set(held) == set(names):
        raise table.error("hold_back", "names all data: nothing is left to fit.")
    chosen = [name for name in names if name not in held]
    try:
        evidence = evidence_of(data.only(chosen), study)
        result, many = _fitted(study, evidence, data.only(chosen), out)
        for _ in range(_ROUNDS):
            lowered = lowered_noise(data, chosen, result.model) if np.isfinite(result.cost) else None
            if lowered is None:
                break
            data = lowered
            evidence = evidence_of(data.only(chosen), study)
            result = _fitted_once(study, evidence, result.model, data.only(chosen))
        hints = timing_hint(
            data.only(chosen),
            result,
            lambda other, start=result.model: _fitted_once(study, evidence_of(other, study), start, other),
        )
        verdicts = identifiability(result)
    except InputError as error:
        if str(study.document.file) in str(error):
            raise
        raise table.error("", str(error)) from error
    controls: tuple[Control, ...] = ()
    if table.flag("controls", True) and np.isfinite(result.cost):
        controls = _controls(study, evidence, data.only(held), result)
    simulated, problems = {}, []
    for one in data.records:
        trajectory = simulate_record(result.model, one)
        if problem := status_of(trajectory):
            problems.append(f"{one.name}: {problem}")
        simulated[one.name] = {name: np.asarray(trajectory.channel(name)) for name in one.deviation}
    responses = {}
    for one in data.responses:
        model = one.respond(result.model, one.measured.frequency)
        index = np.ix_([model.outputs.index(o) for o in one.outputs], [model.inputs.index(i) for i in one.inputs])
        measured = one.measured
        responses[one.name] = (
            measured,
            FRF(measured.frequency, model.values[index], measured.outputs, measured.inputs, measured.form),
        )
    return FitRun(data, result, many, verdicts, controls, simulated, responses, tuple(problems), held, hints)


def _fitted(
    study: StudyFile, evidence: AbstractResidual, data: StudyData, out: Path | None
) -> tuple[FitResult, MultistartResult | None]:
    table = study.table("fit", known=FIT_KEYS)
    starts = table.integer("starts", 1)
    if starts == 1:
        return _fitted_once(study, evidence, study.model, data), None
    many = multistart(
        evidence,
        study.model,
        study.space,
        starts=starts,
        seed=study.seed,
        max_steps=table.integer("max_steps", MAX_STEPS),
        correlated=_series(study, data),
        store=None if out is None else out / "store",
    )
    return many.best, many


def _fitted_once(study: StudyFile, evidence: AbstractResidual, start: Any, data: StudyData) -> FitResult:
    steps = study.table("fit", known=FIT_KEYS).integer("max_steps", MAX_STEPS)
    return fit(evidence, start, study.space, max_steps=steps, correlated=_series(study, data))


def _series(study: StudyFile, data: StudyData) -> int | None:
    """How many series of correlated errors there are: each channel of each record is one; None for white errors."""
    table = study.table("fit", known=FIT_KEYS)
    if not table.flag("correlated", False):
        return None
    if len({one.record.times.size for one in data.records}) != 1 or data.responses:
        raise table.error(
            "correlated", "needs records of one length and no frequency responses. Cut them by `start` and `stop`."
        )
    return sum(len(one.deviation) for one in data.records)


def _controls(study: StudyFile, evidence: AbstractResidual, held: StudyData, result: FitResult) -> tuple[Control, ...]:
    found: list[Any] = []
    if held.records or held.responses:
        found.append(held_back(evidence, evidence_of(held, study), result.model))
    else:
        found.append(held_back_share(evidence, result.model, result.space))
    found.append(permuted_control(evidence, result.model, result.space, result.model, seed=study.seed))
    return tuple(found)


def summary_of(found: FitRun) -> dict[str, Any]:
    """The fit as plain numbers and text.

    Args:
        found: the fit.
    """
    result = found.result
    intervals = result.intervals()
    parameters = {
        path: {
            **result[path]._asdict(),
            "interval_95": intervals[i].tolist(),
            "verdict": found.verdicts[path].sentence,
        }
        for i, path in enumerate(result.space.paths)
    }
    errors = {
        one.name: {
            channel: relative_error(measured, measured - found.simulated[one.name][channel])
            for channel, measured in ((name, np.asarray(one.record.channel(name))) for name in one.deviation)
        }
        for one in found.data.records
    }
    summary: dict[str, Any] = {
        "status": result.message,
        "converged": result.success,
        "parameters": parameters,
        "derived": {name: one._asdict() for name, one in derived_of(result).items()},
        "rms": result.rms,
        "degrees_of_freedom": result.degrees_of_freedom,
        "steps": result.steps,
        "condition_number": result.condition_number,
        "relative_errors": errors,
        "held_back": list(found.held),
        "controls": [{"name": c.name, "passed": c.passed, "sentence": c.sentence} for c in found.controls],
        "problems": list(found.problems),
        "remarks": list(found.data.remarks),
    }
    if found.many is not None:
        summary["starts"] = {
            "message": found.many.message,
            "converged": int(found.many.success.sum()),
            "drawn": len(found.many.costs),
        }
    return summary


def _text(study: StudyFile, found: FitRun, summary: dict[str, Any], report: Path) -> str:
    result = found.result
    lines = [study.title, shown_estimates(result), *shown_derived(derived_of(result)), result.message]
    if found.many is not None:
        lines.append(found.many.message)
    for name, errors in summary["relative_errors"].items():
        role = "predicted" if name in found.held else "fitted"
        told = ", ".join(f"{channel} {100 * error:.3g} %" for channel, error in errors.items())
        lines.append(f"{name} ({role}), relative error: {told}")
    lines += [f"Control {c['name']}: {c['sentence']}" for c in summary["controls"]]
    lines += found.problems
    if result.stop == "too_many_steps":
        steps = study.table("fit", known=FIT_KEYS).integer("max_steps", MAX_STEPS)
        lines.append(
            f"Write max_steps = {4 * steps} into [fit] (it was {steps}), or go on from where it stopped: "
            f"drivetwin fit {report.with_name('fitted.toml')}"
        )
    lines += [f"Warning: {warning}" for warning in summary["warnings"]]
    return "\n".join([*lines, f"Report: {report}"])
