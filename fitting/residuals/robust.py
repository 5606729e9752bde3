"""Evidence with outliers: any residual under a robust loss."""

from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.residuals.losses import AbstractLoss
from fitting.residuals.residual import AbstractCompositeResidual, AbstractResidual, Piece, pieces
from twin._checks import InputError, as_scalar, positive

Evidence = TypeVar("Evidence", bound=AbstractResidual)

# Median of |x| of a standard normal variable.
_NORMAL_MEDIAN = 0.6744897501960817


class RobustResidual(AbstractCompositeResidual):
    """A residual under a robust loss, entry by entry: φ(r) in place of r, so that least squares minimises the loss.

    The threshold of the loss counts in standard deviations of the noise. If the weights of the part are right, that is
    the unit of its residual, and `scale` stays 1; if they are right only among each other, give the standard deviation
    of the part's residual as `scale`, or have it measured by `with_measured_scale`. Within the threshold the residual
    stays as it is, whatever the scale, and so does its weight against other evidence.

    Real and imaginary part of a frequency response are two entries.

    Raises:
        InputError: a loss around evidence that has a loss already, or a scale that is not positive.
    """

    part: AbstractResidual
    """The evidence."""
    loss: AbstractLoss
    """The loss."""
    scale: Float[Array, ""] = eqx.field(converter=as_scalar, default=1.0)
    """Standard deviation of the part's residual where there are no outliers [-]."""

    def __check_init__(self):
        positive("scale", self.scale)
        if any(_is_robust(node) for node in jax.tree.leaves(self.part, is_leaf=_is_robust)):
            raise InputError(
                "A robust loss around evidence that has one already has no meaning. Put the loss around each part once."
            )

    def pieces(self, model: Any) -> tuple[Piece, ...]:
        # One loss with one scale is one piece, whatever it is made of.
        plain = jnp.concatenate([piece.plain for piece in pieces(self.part, model)])
        units = plain / self.scale
        return (Piece("", plain, self.scale * self.loss(units), self.loss.curvature(units)),)


def without_loss(residual: AbstractResidual) -> AbstractResidual:
    """The evidence with every robust loss taken off.

    Args:
        residual: any evidence.
    """
    return jax.tree.map(lambda x: x.part if _is_robust(x) else x, residual, is_leaf=_is_robust)


def with_measured_scale(residual: Evidence, model: Any) -> Evidence:
    """The evidence with the scale of every robust loss measured from what a fitted model leaves over.

    For weights that are right only among each other: fit, measure the scale, and fit again from there. The scale is
    the median of |r| over that of a standard normal variable, to which up to half of the residuals may be outliers
    (the median is about zero, where the residuals of a model that fits are centred). Standard errors of the second fit
    stay valid: for symmetric errors, what the scale misses does not reach the estimates in first order (Huber and
    Ronchetti, Robust Statistics, 2nd ed. 2009, ch. 6).

    Args:
        residual: the evidence of the first fit.
        model: the model of the first fit.

    Raises:
        InputError: if more than half of a part's residuals are zero or any is not finite, so that they have no scale.
    """
    # The pieces under a loss come in the order in which the tree holds the losses.
    found = eqx.filter_jit(pieces)(residual, model)
    scales = iter([_scale_of(piece) for piece in found if piece.curvature is not None])

    def rescaled(node: Any) -> Any:
        return RobustResidual(node.part, node.loss, next(scales)) if _is_robust(node) else node

    return jax.tree.map(rescaled, residual, is_leaf=_is_robust)


def _scale_of(piece: Piece) -> float:
    scale = float(np.median(np.abs(np.asarray(piece.plain)))) / _NORMAL_MEDIAN
    if not (np.isfinite(scale) and scale > 0):
        raise InputError(
            f"Evidence {piece.name!r}: the median of the {piece.plain.size} residuals' magnitude is {scale:g}, which "
            "is no scale. Look at the fit, or give the scale of this loss yourself."
        )
    return scale


def _is_robust(node: Any) -> bool:
    return isinstance(node, RobustResidual)
