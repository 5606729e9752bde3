"""Units of what the model of a study gives out, as far as its own text says them.

A drive that may be linear or rotary says "[m or rad]"; which of the two is meant shows in the units of its parameters.
"""

import inspect
from typing import Any

import jax
import jax.numpy as jnp

from fitting.study.study_file import StudyFile
from twin.io.class_fields import facts_of
from twin.io.rotary import pick_unit, rotary_of
from twin.io.units import si_unit
from twin.plant import AbstractPlant


def output_units(study: StudyFile) -> dict[str, str]:
    """SI unit of each output; empty where that is open.

    Args:
        study: the study.

    Raises:
        InputError: a model that cannot be built.
    """
    loop = not isinstance(study.model, AbstractPlant)
    plant = study.model.plant if loop else study.model
    kind: Any = type(jax.eval_shape(plant.outputs, jnp.zeros(()), plant.initial_state(), plant.rest_inputs()))
    table = study.document.table(("model",))
    written = table.get("plant", table) if loop or "plant" in table else table
    rotary = rotary_of(facts_of(type(plant)), written)
    facts = facts_of(kind) if inspect.isclass(kind) else {}
    found = {}
    for name in getattr(kind, "_fields", ()):
        unit = pick_unit(facts[name].units, rotary) if name in facts else ""
        found[name] = si_unit(unit, unit, name=name) if unit else ""
    return found
