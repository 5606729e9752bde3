"""Two-mass drive from the frequency responses of motor and load: no model, no start is needed.

[identify]
procedure = "two_mass"
motor = "motor_angle"
load = "load_angle"
excitation = "current"
"""

import dataclasses
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from fitting.identification.two_mass import identify_two_mass, two_mass_response
from fitting.result import FitResult
from fitting.study.data import data_names
from fitting.study.procedures._found import Found
from fitting.study.responses import read_response
from fitting.study.study_file import StudyFile
from twin._checks import InputError
from twin.drives import TwoMass
from twin.frf import FRF
from twin.io.toml_document import unknown
from twin.io.toml_table import TomlTable
from twin.parameters import ParameterSpace
from twin.paths import set_leaves

HELP = "inertias, stiffness, damping, frictions and dead time of a two-mass drive from its frequency responses"
KEYS = ("motor", "load", "excitation", "residual", "data")


def run(study: StudyFile, table: TomlTable, out: Path) -> Found:
    """Identify, and return resonance and parameters.

    Args:
        study: the study; of its [data] one frequency response.
        table: [identify].
        out: folder for the results; nothing of its own is written here.

    Raises:
        InputError: no frequency response, unknown names, or a response that is not that of a two-mass drive.
    """
    names = data_names(study, "frf")
    name = table.text("data", names[0] if names else None)
    if name not in names:
        raise table.error("data", unknown("frequency response", name, names))
    measured = read_response(study, name).measured
    motor, load = table.text("motor", measured.outputs[0]), table.text("load", measured.outputs[-1])
    excitation = table.text("excitation", measured.inputs[0])
    kind = table.text("residual", "log", choices=("log", "complex"))
    try:
        found = identify_two_mass(measured, kind=kind, motor=motor, load=load, excitation=excitation)
    except InputError as error:
        raise InputError(
            f"{error} Or narrow `band` of the data set to the lines around antiresonance and resonance."
        ) from error
    constant = _torque_constant(study)
    result = found.result if constant is None else times_constant(found.result, constant)
    told = (
        "Inertias, stiffness, damping and frictions are in units of the torque constant: give [model] with its gain "
        "where the excitation is a current."
        if constant is None
        else f"Counted with the torque constant of the model, gain = {constant:g}."
    )
    lines = [result.to_dataframe()[["unit", "estimate", "standard error", "remark"]].to_string()]
    for quantity, estimate in found.modes._asdict().items():
        lines.append(
            f"{quantity.replace('_', ' '):16} {estimate.value:12.6g} ± {estimate.standard_error:.2g} {estimate.unit}"
        )
    model = two_mass_response(found.model, measured.frequency)
    rows = [measured.outputs.index(motor), measured.outputs.index(load)]
    column = [measured.inputs.index(excitation)]
    shown = FRF(
        measured.frequency,
        jnp.asarray(measured.values)[np.ix_(rows, column)],
        (motor, load),
        (excitation,),
        measured.form,
    )
    fitted = FRF(measured.frequency, model.values, (motor, load), (excitation,), measured.form)
    summary = {
        "parameters": {path: one._asdict() for path, one in result.estimates().items()},
        "modes": {quantity: one._asdict() for quantity, one in found.modes._asdict().items()},
        "status": result.message,
        "torque_constant": constant,
    }
    return Found("\n".join([*lines, told, result.message]), summary, result, {name: (shown, fitted)})


def _torque_constant(study: StudyFile) -> float | None:
    """Torque per unit of the excitation that the study's model says; None where it has no model."""
    if "model" not in study.document.data:
        return None
    drive = getattr(study.model, "plant", study.model)
    return float(drive.gain) if isinstance(drive, TwoMass) else None


def times_constant(result: FitResult, constant: float) -> FitResult:
    """A fit in units of the torque constant, in SI.

    Args:
        result: fit of a two-mass drive behind a dead time, with a gain of one.
        constant: the torque constant.

    Raises:
        InputError: a constant that is not positive.
    """
    if not constant > 0:
        raise InputError(f"gain must be positive, but is {constant:g}. Turn the sign of the excitation round.")
    values, scaled, parameters = result.values.copy(), result.scaled.copy(), []
    for i, parameter in enumerate(result.space.parameters):
        if parameter.path == "delay":
            parameters.append(parameter)
            continue
        values[i] *= constant
        scaled[i] += np.log(constant) if parameter.scale == "log" else 0.0
        size = None if parameter.size is None else constant * parameter.size
        bounds = {"lower": constant * parameter.lower, "upper": constant * parameter.upper}
        parameters.append(dataclasses.replace(parameter, size=size, **bounds))
    space = ParameterSpace(parameters)
    model = space.with_values(set_leaves(result.model, {"plant.gain": constant}), jnp.asarray(values))
    return dataclasses.replace(result, values=values, scaled=scaled, space=space, model=model)
