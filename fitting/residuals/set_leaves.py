"""Evidence that was taken from its own beginning: some numbers of the model are those of the data set."""

from typing import TypeVar

import equinox as eqx
from jaxtyping import Array, Float

from fitting.residuals.residual import AbstractCompositeResidual, AbstractResidual, Piece, pieces
from twin.paths import set_leaves

Model = TypeVar("Model")


class WithLeaves(AbstractCompositeResidual):
    """A residual that sees the model with some of its numbers replaced, such as the position at which a record begins.

    What is replaced must not be free: the fit would not see it move.
    """

    part: AbstractResidual
    """The evidence."""
    values: tuple[Float[Array, ""], ...]
    """The numbers, SI."""
    paths: tuple[str, ...] = eqx.field(static=True)
    """Their dotted paths into the model."""

    def pieces(self, model) -> tuple[Piece, ...]:
        return pieces(self.part, self.seen(model))

    def seen(self, model: Model) -> Model:
        """The model that the part sees.

        Args:
            model: the model.
        """
        return set_leaves(model, dict(zip(self.paths, self.values, strict=True)))
