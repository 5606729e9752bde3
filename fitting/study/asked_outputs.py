"""The outputs that a table of a study asks for, ready to be computed."""

from typing import Any, NamedTuple

import jax.numpy as jnp

from fitting.study.channels import output_names
from fitting.study.motion import read_motion
from fitting.study.outputs import AskedOutputs, parse_outputs
from fitting.study.study_file import StudyFile
from fitting.study.units_of_outputs import output_units
from twin._checks import InputError
from twin.control import ClosedLoop, SampledLoop
from twin.io.toml_table import TomlTable
from twin.references import MotionPoint


class Asked(NamedTuple):
    """What is asked, and of which model."""

    function: AskedOutputs
    """From the model to the numbers."""
    model: Any
    """The model, beginning where its motion begins."""


def asked_outputs(study: StudyFile, table: TomlTable) -> Asked:
    """Read the key `outputs`.

    Args:
        study: the study.
        table: a table with that key.

    Raises:
        InputError: naming line and key: nothing asked, an unknown output, no motion to simulate.
    """
    loop = isinstance(study.model, ClosedLoop | SampledLoop)
    try:
        asked = parse_outputs(table.texts("outputs"), output_names(study.model), MotionPoint._fields if loop else ())
    except InputError as error:
        if str(study.document.file) in str(error):
            raise
        raise table.error("outputs", str(error)) from error
    if not asked:
        raise table.error("outputs", 'asks nothing. Write what you want, such as ["max(position)"].')
    bare = AskedOutputs(asked, stepping=study.stepping)
    if not bare.simulates:
        return Asked(bare, study.model)
    motion = read_motion(study)
    return Asked(AskedOutputs(asked, motion.reference, jnp.asarray(motion.times), study.stepping), motion.model)


def units_of_asked(study: StudyFile, asked: Asked) -> dict[str, str]:
    """Units of the numbers asked, by their names; of those that are known.

    Args:
        study: the study.
        asked: what is asked.
    """
    of_channels = output_units(study)
    found = {}
    for what, of in asked.function.asked:
        unit = {"frequency": "Hz", "damping": "1"}.get(what) or of_channels.get(of, "")
        if unit:
            found[f"{what}({of})"] = unit
    return found
