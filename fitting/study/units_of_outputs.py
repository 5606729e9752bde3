"""Units of what the model of a study gives out, as far as its own text says them.

A drive that may be linear or rotary says "[m or rad]"; which of the two is meant shows in the units of its parameters.
"""

import inspect
from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp

from fitting.study.study_file import StudyFile
from twin._checks import InputError
from twin.io.class_fields import FieldFacts, facts_of
from twin.io.quantity import parse_quantity
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
    kind = type(jax.eval_shape(plant.outputs, jnp.zeros(()), plant.initial_state(), plant.rest_inputs()))
    table = study.document.table(("model",))
    written = table.get("plant", table) if loop or "plant" in table else table
    second = _is_second(written, facts_of(type(plant)))
    facts = facts_of(kind) if inspect.isclass(kind) else {}
    found = {}
    for name in kind._fields:
        units = facts[name].units if name in facts else None
        unit = units[min(second, len(units) - 1)] if units else ""
        found[name] = si_unit(unit, unit, name=name) if unit else ""
    return found


def _is_second(table: Mapping[str, Any], facts: Mapping[str, FieldFacts]) -> int:
    """1 where a parameter has the unit of its second alternative, else 0."""
    for name, written in table.items():
        units = facts[name].units if name in facts else None
        choice = units is not None and len(units) > 1 and isinstance(written, str)
        if choice and not _has(written, units[0]) and _has(written, units[1]):
            return 1
    return 0


def _has(written: str, unit: str) -> bool:
    try:
        parse_quantity(written, (unit,))
    except InputError:
        return False
    return True
