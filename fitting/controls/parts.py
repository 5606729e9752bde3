"""Evidence with its records and responses replaced, however deep they are within it."""

from collections.abc import Callable
from typing import Any

import jax

from fitting.residuals.frequency_response import FrequencyResponseResidual
from fitting.residuals.linear import LinearResidual
from fitting.residuals.residual import AbstractCompositeResidual, AbstractResidual
from fitting.residuals.trajectory import TrajectoryResidual
from fitting.residuals.weighted import Weighted
from twin._checks import InputError

Change = Callable[[Any], AbstractResidual]


def with_parts(
    evidence: AbstractResidual, record: Change, response: Change, rows: Change, other: Change | None = None
) -> AbstractResidual:
    """The evidence with each piece of it replaced.

    Args:
        evidence: any evidence; pieces are looked for inside joint, selected, weighted and robust evidence.
        record: what replaces a `TrajectoryResidual`.
        response: what replaces a `FrequencyResponseResidual`.
        rows: what replaces a `LinearResidual`.
        other: what replaces any other kind of evidence, which stays as it is if not given.

    Raises:
        InputError: neither a record nor a response in the evidence.
    """
    found = []
    changes = {TrajectoryResidual: record, FrequencyResponseResidual: response, LinearResidual: rows}

    def replaced(node: Any) -> Any:
        if type(node) in changes:
            found.append(node)
            return changes[type(node)](node)
        return other(node) if other is not None and _is_piece(node) else node

    changed = jax.tree.map(replaced, evidence, is_leaf=_is_piece)
    if not found:
        raise InputError(
            f"There is neither a record nor a frequency response in this evidence ({type(evidence).__name__}), so "
            "nothing of it can be held back or shuffled. Use TrajectoryResidual, FrequencyResponseResidual or "
            "LinearResidual."
        )
    return changed


def _is_piece(node: Any) -> bool:
    return isinstance(node, AbstractResidual) and not isinstance(node, AbstractCompositeResidual | Weighted)
