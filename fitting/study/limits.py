"""Limits of a model that a record does not keep."""

from typing import Any

import numpy as np

from twin.record import Record

# A command at its limit exceeds it by its noise.
_NOISE = 1.05


def limit_warnings(model: Any, record: Record, name: str) -> tuple[str, ...]:
    """A sentence where a record's command is larger than the controller of the model lets through.

    Args:
        model: a drive or a loop.
        record: the record, with a channel `command` or without.
        name: name of the data set.
    """
    limit = float(getattr(getattr(model, "controller", None), "command_limit", np.inf))
    if "command" not in record.channels:
        return ()
    reached, unit = float(np.max(np.abs(np.asarray(record.channel("command"))))), record.units["command"]
    if reached <= _NOISE * limit:
        return ()
    return (
        f"{name}: the record's command reaches {reached:.3g} {unit}, the model cuts at {limit:.3g} {unit}. Raise "
        "controller.command_limit in [model], or see whether the unit of the channel is right.",
    )
