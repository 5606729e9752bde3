"""Two-mass drive from the frequency responses of motor and load: no model, no start is needed.

[identify]
procedure = "two_mass"
motor = "motor_angle"
load = "load_angle"
excitation = "current"
"""

from pathlib import Path

import jax.numpy as jnp
import numpy as np

from fitting.identification.two_mass import identify_two_mass, two_mass_response
from fitting.study.data import data_names
from fitting.study.procedures._found import Found
from fitting.study.responses import read_response
from fitting.study.study_file import StudyFile
from twin.frf import FRF
from twin.io.toml_document import unknown
from twin.io.toml_table import TomlTable

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
    found = identify_two_mass(measured, kind=kind, motor=motor, load=load, excitation=excitation)
    lines = [found.result.to_dataframe()[["unit", "estimate", "standard error", "remark"]].to_string()]
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
        "parameters": {path: one._asdict() for path, one in found.result.estimates().items()},
        "modes": {quantity: one._asdict() for quantity, one in found.modes._asdict().items()},
        "status": found.result.message,
    }
    return Found("\n".join([*lines, found.result.message]), summary, found.result, {name: (shown, fitted)})
