"""Evidence about a part of the model: one data set of several, or the plant inside a loop."""

import dataclasses
from collections.abc import Iterable, Sequence
from typing import Any

import equinox as eqx

from fitting.residuals.residual import AbstractCompositeResidual, AbstractResidual, Piece, pieces
from twin._checks import InputError
from twin.parameters import ParameterSpace
from twin.paths import get_part


class SelectedResidual(AbstractCompositeResidual):
    """A residual that is shown only one part of the model.

    A model of several data sets is a dict or tuple of models, `{"low": model, "high": model}`, with
    `across` for the parameters that they share.
    """

    part: AbstractResidual
    """The evidence."""
    key: str = eqx.field(static=True)
    """Dotted path of the part of the model that it is about, `high` or `loop.plant`."""

    def pieces(self, model: Any) -> tuple[Piece, ...]:
        return pieces(self.part, get_part(model, self.key))


def across(space: ParameterSpace, names: Sequence[str], *, free: Iterable[str] = ()) -> ParameterSpace:
    """The space for several data sets that share parameters, from the space of one.

    The model is then a dict of models, `{"low": model, "high": model}`, or a tuple of them with names "0", "1".

    Args:
        space: free parameters of one model.
        names: names of the data sets, as in the dict of models.
        free: paths of the space that each data set has for itself; a prior then holds for each. All others are tied
            over all data sets.

    Returns:
        The space, in the order given: a tied parameter has the first data set's path.

    Raises:
        InputError: no name, a name twice or with a dot, a path that is not in the space.
    """
    if not names or len(set(names)) != len(names) or any("." in name for name in names):
        raise InputError(
            f"names must be different names of data sets without dots, but is {tuple(names)}. Use the keys of the dict "
            "of models."
        )
    own = {space[path].path for path in free}
    found = []
    for parameter in space.parameters:
        paths = [f"{name}.{path}" for name in names for path in (parameter.path, *parameter.tied)]
        size = len(paths) // len(names) if parameter.path in own else len(paths)
        for start in range(0, len(paths), size):
            first, *others = paths[start : start + size]
            found.append(dataclasses.replace(parameter, path=first, tied=tuple(others)))
    return ParameterSpace(found)
