"""The force that holds an axis at rest: the mean of its current over a stretch without motion."""

from pathlib import Path

import numpy as np

from fitting.study.data import data_names, read_record
from fitting.study.procedures._found import Found
from fitting.study.study_file import StudyFile
from twin.io.toml_table import TomlTable

HELP = "force that holds an axis at rest, from the current while it stands"
KEYS = ("force_constant",)


def run(study: StudyFile, table: TomlTable, out: Path) -> Found:
    """One force for each record.

    Args:
        study: the study; its records hold the channel `current`.
        table: [identify].
        out: folder for the results.

    Raises:
        InputError: no force constant, or no channel `current`.
    """
    constant = table.quantity("force_constant", units=("N/A",), positive=True).value
    forces = {}
    for name in data_names(study, "record"):
        current = np.asarray(read_record(study, name).record.channel("current"))
        forces[name] = constant * float(current.mean())
    (out / "forces.csv").write_text("\n".join(f"{name},{force!r}" for name, force in forces.items()) + "\n")
    return Found("\n".join(f"{name}: {force:.4g} N" for name, force in forces.items()), {"forces": forces})
