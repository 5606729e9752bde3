"""The interface of evidence: data held inside, called with a model, returns a weighted residual."""

import abc
from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from twin._checks import InputError


class AbstractResidual(eqx.Module):
    """Evidence about a model: its residual is real, and weighted so that unit variance means "as good as the data"."""

    @abc.abstractmethod
    def __call__(self, model: Any) -> Float[Array, "residuals"]:
        """The weighted residual (model minus measured, over the standard deviation) of a model."""


class Piece(eqx.Module):
    """What one piece of evidence says about a model."""

    name: str = eqx.field(static=True)
    """Name of the piece within the joint evidence; empty if there is only one."""
    plain: Float[Array, "residuals"]
    """Weighted residual, before any robust loss."""
    values: Float[Array, "residuals"]
    """Weighted residual as it enters the sum of squares."""
    curvature: Float[Array, "residuals"] | None
    """True curvature of the cost over that of the sum of squares, row by row; None where both are the same."""


class AbstractCompositeResidual(AbstractResidual):
    """Evidence made of other evidence, which is stacked."""

    @abc.abstractmethod
    def pieces(self, model: Any) -> tuple[Piece, ...]:
        """What each piece says about a model, in the order of the residual."""

    def __call__(self, model: Any) -> Float[Array, "residuals"]:
        return jnp.concatenate([piece.values for piece in self.pieces(model)])


def pieces(residual: AbstractResidual, model: Any) -> tuple[Piece, ...]:
    """What each piece of some evidence says about a model.

    Args:
        residual: any evidence.
        model: the model, such as a fitted one.

    Raises:
        InputError: if a piece is not a vector, or refuses the model.
    """
    if isinstance(residual, AbstractCompositeResidual):
        return residual.pieces(model)
    values = residual(model)
    if values.ndim != 1:
        raise InputError(f"A residual must be a vector, but this one has shape {values.shape}. Flatten it by ravel().")
    return (Piece("", values, values, None),)


def evaluate(
    residual: AbstractResidual, model: Any
) -> tuple[Float[Array, "residuals"], Float[Array, "residuals"] | None]:
    """A residual together with what `covariance_of` has to know about its losses.

    Args:
        residual: any evidence.
        model: the model.

    Returns:
        The residual, and the curvature of each row (see `Piece`); None if there is no robust loss in the evidence.

    Raises:
        InputError: as `pieces`.
    """
    found = pieces(residual, model)
    values = jnp.concatenate([piece.values for piece in found])
    if all(piece.curvature is None for piece in found):
        return values, None
    rows = [jnp.ones_like(piece.values) if piece.curvature is None else piece.curvature for piece in found]
    return values, jnp.concatenate(rows)


class JointResidual(AbstractCompositeResidual):
    """Several pieces of evidence about one model, fitted together.

    They add up rightly if each is weighted by the standard deviation of its own noise: the pieces are then in the same
    unit, whatever they measure.

    Raises:
        InputError: no part, or names that do not match the parts; when called, a part that refuses the model, with the
            part's name.
    """

    parts: tuple[AbstractResidual, ...]
    """The pieces; their residuals are stacked."""
    names: tuple[str, ...] = eqx.field(static=True, default=())
    """Name of each piece for messages and tables; number and kind if empty."""

    def __check_init__(self):
        if not self.parts:
            raise InputError("A joint residual needs at least one part.")
        if self.names and len(self.names) != len(self.parts):
            raise InputError(
                f"names gives {len(self.names)} names ({', '.join(self.names)}) for {len(self.parts)} parts. "
                "Name each part, or none."
            )

    def pieces(self, model: Any) -> tuple[Piece, ...]:
        found = []
        for name, part in zip(self._labels(), self.parts, strict=True):
            try:
                inner = pieces(part, model)
            except InputError as error:
                raise InputError(f"Evidence {name!r}: {error}") from error
            found += [_renamed(piece, name) for piece in inner]
        return tuple(found)

    def _labels(self) -> Sequence[str]:
        return self.names or [f"{i} ({type(part).__name__})" for i, part in enumerate(self.parts)]


def _renamed(piece: Piece, name: str) -> Piece:
    full = f"{name}.{piece.name}" if piece.name else name
    return Piece(full, piece.plain, piece.values, piece.curvature)
