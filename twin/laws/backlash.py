"""Backlash: the play of a mesh, as a smooth dead zone of its deflection."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import as_scalar, not_negative, positive
from twin.laws.smooth import smooth_abs


class Backlash(eqx.Module):
    """How far the flanks of a mesh are pressed into each other: the deflection less half the play, on either side.

    ε(δ) = δ + ½·|δ - b/2| - ½·|δ + b/2|, with both magnitudes smoothed over a width. It is odd, infinitely
    differentiable, and its slope, which runs from nearly 0 within the play to 1 outside, is the share of the flanks in
    contact.

    Raises:
        InputError: if the play is negative, the width is not positive, or either is not finite.
    """

    play: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Play b between the flanks, from one side to the other [m]."""
    width: Float[Array, ""] = eqx.field(converter=as_scalar, default=1e-7)
    """Deflection w over which contact is made [m]; without play it drops out."""

    def __check_init__(self):
        not_negative("play", self.play, "m")
        positive("width", self.width, "m")

    def __call__(self, deflection: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        """Indentation ε of the flanks [m].

        Args:
            deflection: δ, of any shape [m].
        """
        upper, lower = self._ends(deflection)
        # The difference of the two magnitudes without cancellation where both are large.
        return jnp.asarray(deflection) * (1 - self.play / (upper + lower))

    def contact(self, deflection: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        """Share of the flanks in contact dε/dδ, from 0 to 1 [-].

        Args:
            deflection: δ, of any shape [m].
        """
        delta, half = jnp.asarray(deflection), 0.5 * self.play
        upper, lower = self._ends(deflection)
        return 1 + 0.5 * (delta - half) / upper - 0.5 * (delta + half) / lower

    def _ends(self, deflection: ArrayLike) -> tuple[Array, Array]:
        half = 0.5 * self.play
        delta = jnp.asarray(deflection)
        return smooth_abs(delta - half, self.width), smooth_abs(delta + half, self.width)
