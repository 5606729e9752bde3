"""Servo axis from position and command by least squares: no start, no simulation.

[identify]
procedure = "inverse_dynamics"
decimation = 10
slowest = "5 mm/s"                     # slower samples are left out; "0 mm/s" keeps all
free = ["mass", "friction.coulomb"]    # which of [free] to find; all, if it is not given
"""

import dataclasses
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np

from fitting.controls import held_back_share, permuted_control
from fitting.controls.relative_error import relative_error
from fitting.fit import fit
from fitting.identifiability import identifiability
from fitting.identification.inverse_dynamics import (
    DerivativeFilter,
    ForceRegression,
    force_regression,
    moving_speed,
    nonlinear_parameters,
    row_noise,
)
from fitting.report.compared import Compared
from fitting.study.data import RecordData, data_names, read_record
from fitting.study.derived import derived_of
from fitting.study.free_parameters import without_prefix
from fitting.study.noise import noise_deviation
from fitting.study.procedures._found import Found
from fitting.study.shown import shown_derived, shown_estimates
from fitting.study.study_file import StudyFile
from fitting.study.written import write_fitted
from twin.control import SampledLoop
from twin.drives import CurrentDrivenAxis, ServoAxis
from twin.io.toml_document import unknown
from twin.io.toml_table import TomlTable
from twin.laws import StribeckFriction
from twin.parameters import ParameterSpace
from twin.record import Record

HELP = "mass, friction and offset of a servo axis from its position and command, by least squares"
KEYS = ("decimation", "data", "free", "slowest", "cutoff")

# What turns the command into a force scales all other parameters, and is taken as known.
_SCALES = ("gain", "torque_constant", "travel_per_turn")
_OR = "or name in `free` of [identify] what is to be found;"


def run(study: StudyFile, table: TomlTable, out: Path) -> Found:
    """Identify the free parameters of a servo axis; writes `fitted.toml`, from which a fit can go on.

    Args:
        study: the study; its model a `ServoAxis` or `CurrentDrivenAxis`, alone or in a loop.
        table: [identify].
        out: folder for the results.

    Raises:
        InputError: another model, no record with `position` and `command`, `current` or `force`, a free parameter that
            the force is not linear in, and as `force_regression`.
    """
    axis, prefix = _axis(study, table)
    names = data_names(study, "record")
    name = table.text("data", names[0] if names else None)
    if name not in names:
        raise table.error("data", unknown("record", name, names))
    one = read_record(study, name)
    record = _with_force(study, one, axis)
    whole = _searched(study, table, axis, prefix)
    space = without_prefix(whole, prefix) if prefix else whole
    axis = space.with_values(axis, space.values(axis))  # what is tied may begin at other values in the file
    # Some 100 Hz hold what an axis does; slow records have less.
    cutoff = f"{min(100.0, 0.2 * float(record.sample_rate))} Hz"
    derivatives = DerivativeFilter(cutoff=table.quantity("cutoff", cutoff, units=("Hz",), positive=True).value)
    velocity = derivatives(np.asarray(record.channel("position")), float(record.sample_period))[1]
    _check_free(study, axis, space, whole, velocity)
    decimation, unit = table.integer("decimation", 10), record.units["position"]
    scatter = noise_deviation(np.asarray(record.channel("position")))
    slowest = (
        table.quantity("slowest", units=(f"{unit}/s",)).value
        if "slowest" in table
        else moving_speed(record, derivatives, deviation=scatter)
    )
    rows = force_regression(record, axis, space, derivatives=derivatives, decimation=decimation, slowest=slowest)
    deviation = row_noise(decimation) * noise_deviation(np.asarray(record.channel("force")))
    evidence = rows.residual(space, deviation)
    plain = fit(evidence, axis, space, correlated=1)
    controls = (
        held_back_share(evidence, plain.model, space),
        permuted_control(evidence, plain.model, space, plain.model, seed=study.seed),
    )
    # Named as in [free], and with the whole model.
    model = whole.with_values(study.model, jnp.asarray(plain.values))
    result = dataclasses.replace(plain, space=whole, model=model, warning=_scale_told(study, prefix))
    write_fitted(study, out, whole, dict(zip(whole.paths, result.values.tolist(), strict=True)))
    compared = _compared(name, rows, result.values, deviation, unit)
    error = relative_error(compared.measured, compared.error)
    told = _told(rows, unit)
    derived = derived_of(result)
    lines = [
        shown_estimates(result),
        *shown_derived(derived),
        result.message,
        f"{name}, relative error: force {100 * error:.3g} %",
        told,
        *(f"Control {control.name}: {control.sentence}" for control in controls),
    ]
    summary: dict[str, Any] = {
        "parameters": {path: estimate._asdict() for path, estimate in result.estimates().items()},
        "derived": {quantity: estimate._asdict() for quantity, estimate in derived.items()},
        "status": result.message,
        "converged": result.success,
        "relative_errors": {name: {"force": error}},
        "slowest": slowest,
        "rows": int(rows.times.size),
        "rows_left_out": rows.left_out,
        "controls": [{"name": c.name, "passed": c.passed, "sentence": c.sentence} for c in controls],
    }
    return Found(
        "\n".join(lines),
        summary,
        result,
        records={name: record},
        verdicts=identifiability(result),
        controls=controls,
        series=(compared,),
        remarks={name: [told, *(remark.removeprefix(f"{name}: ") for remark in one.remarks)]},
        derived=derived,
    )


def _scale_told(study: StudyFile, prefix: str) -> str:
    """What the errors do not hold: the constants that turn the command into a force are taken as known."""
    axis = study.model.plant if prefix else study.model
    names = [name for name in _SCALES if hasattr(axis, name)]
    listed = " and ".join(f"{name} = {float(getattr(axis, name)):.5g}" for name in names)
    return (
        f"All values hold for {listed}, taken as exact: by what these are wrong, in per cent, masses and forces are "
        "wrong as well, whatever their standard errors."
    )


def _axis(study: StudyFile, table: TomlTable) -> tuple[ServoAxis, str]:
    """The axis, and the path of it in the model."""
    prefix = "plant." if isinstance(study.model, SampledLoop) else ""
    axis = study.model.plant if prefix else study.model
    if isinstance(axis, CurrentDrivenAxis):
        return axis.axis, prefix
    if not isinstance(axis, ServoAxis):
        raise table.error(
            "procedure",
            f"inverse_dynamics is for a ServoAxis or a CurrentDrivenAxis, but the model is {type(axis).__name__}.",
        )
    return axis, prefix


def _searched(study: StudyFile, table: TomlTable, axis: ServoAxis, prefix: str) -> ParameterSpace:
    """The free parameters that this procedure is to find: all, or those that its key `free` names."""
    names = table.texts("free", study.space.paths)
    for name in names:
        if name not in study.space.paths:
            raise table.error("free", unknown("free parameter", name, study.space.paths))
        if name.removeprefix(prefix) in _SCALES:
            raise study.document.error(
                ("free",),
                f"a balance of forces cannot tell {name}: it scales all other parameters. Remove {name} from [free], "
                f"{_OR} `drivetwin fit` with a prior counts it in.",
            )
    space = study.space.subset(names)
    if "free" not in table:
        return space
    coulomb, static = f"{prefix}friction.coulomb", f"{prefix}friction.static"
    if not isinstance(axis.friction, StribeckFriction) or coulomb not in names or static in names:
        return space
    # Where slow samples are left out nothing is seen of breakaway, which cannot be less than Coulomb friction.
    return ParameterSpace(
        dataclasses.replace(p, tied=(*p.tied, static)) if p.path == coulomb and static not in p.tied else p
        for p in space.parameters
    )


def _with_force(study: StudyFile, one: RecordData, axis: ServoAxis) -> Record:
    """The record with the channel `force`: measured, or from the channel that drives the axis."""
    record = one.record
    if "force" in record.channels:
        return record
    written = study.document.table(("data", one.name, "inputs")).get("command", "command")
    named = next((name for name in (written, "command", "current") if name in record.channels), "command")
    unit = "N" if record.units["position"] == "m" else "N m"
    return record.with_channel("force", jnp.asarray(axis.gain) * record.channel(named), unit)


def _check_free(
    study: StudyFile, axis: ServoAxis, space: ParameterSpace, whole: ParameterSpace, velocity: np.ndarray
) -> None:
    """Name each line of [free] that the force is not linear in."""
    named = dict(zip(space.paths, whole.paths, strict=True))
    curved = [named[path] for path in nonlinear_parameters(axis, space, velocity)]
    if curved:
        raise study.document.error(
            ("free",),
            f"{', '.join(curved)} {'does' if len(curved) == 1 else 'do'} not enter the force linearly, as "
            f"inverse_dynamics needs. Remove {' and '.join(curved)} from [free], {_OR} "
            "`drivetwin fit` finds all.",
        )


def _compared(name: str, rows: ForceRegression, values: np.ndarray, deviation: float, unit: str) -> Compared:
    speed = ("velocity", f"{unit}/s", rows.velocity)
    modelled = rows.modelled(values)
    force = "N" if unit == "m" else "N m"
    return Compared(name, "force", force, rows.times, rows.force, modelled, np.asarray(deviation), speed)


def _told(rows: ForceRegression, unit: str) -> str:
    """How much was left out, and why."""
    count = rows.times.size + rows.left_out
    shown = f"{1e3 * rows.slowest:.3g} mm/s" if unit == "m" else f"{rows.slowest:.3g} {unit}/s"
    return (
        f"{rows.left_out} of {count} rows were left out, being slower than {shown}: at standstill and in creep "
        "friction can be anything. The key `slowest` in [identify] sets the speed."
    )
