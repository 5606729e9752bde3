"""Stiffness and damping of a contact that depend on the force through it."""

import abc

import equinox as eqx
from jaxtyping import Array, ArrayLike, Float

from twin._checks import as_scalar, not_negative, positive
from twin.laws.smooth import positive_power, smooth_abs


class AbstractLoadLaw(eqx.Module):
    """A property of a contact as a function of the force through it, the same for both signs of the force."""

    @abc.abstractmethod
    def __call__(self, force: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        """The property at a force.

        Args:
            force: force through the contact of any shape and sign [N].
        """


class RootStiffness(AbstractLoadLaw):
    """k(F) = k1 · |F|^(1/k2): flanks that touch over a wider area the harder they are pressed together.

    Leipe et al., "Modeling and Identification of Load-Dependent Properties for Electrically Preloaded Rack-and-Pinion
    Drives", eq. 3. The slope of the root is infinite at zero force; the magnitude is smoothed over a width of force,
    as (F² + w²)^(1/(2·k2)).

    Raises:
        InputError: if a parameter is not positive and finite.
    """

    k1: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Stiffness at a force of one newton k1 [N/m, for F in N]."""
    k2: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Order of the root k2 [-]; the larger, the less the load matters."""
    width: Float[Array, ""] = eqx.field(converter=as_scalar, default=1.0)
    """Force w below which the stiffness stays what it is at w [N]."""

    def __check_init__(self):
        positive("k1", self.k1, "N/m")
        positive("k2", self.k2)
        positive("width", self.width, "N")

    def __call__(self, force: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        return self.k1 * positive_power(smooth_abs(force, self.width), 1 / self.k2)  # eq. 3


class HyperbolicDamping(AbstractLoadLaw):
    """d(F) = d1/(d2 + |F|) + d3: the harder the flanks are pressed together, the less they damp.

    Leipe et al., eq. 8, with the magnitude smoothed over a width of force.

    Raises:
        InputError: if d1 or d3 is negative, d2 or the width is not positive, or any is not finite.
    """

    d1: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Part that the load takes away d1 [N²s/m]."""
    d2: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Force at which half of it is gone d2 [N]."""
    d3: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Damping that stays at any load d3 [Ns/m]."""
    width: Float[Array, ""] = eqx.field(converter=as_scalar, default=1.0)
    """Force w below which the damping stays what it is at w [N]."""

    def __check_init__(self):
        not_negative("d1", self.d1, "N²s/m")
        positive("d2", self.d2, "N")
        not_negative("d3", self.d3, "Ns/m")
        positive("width", self.width, "N")

    def __call__(self, force: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        return self.d1 / (self.d2 + smooth_abs(force, self.width)) + self.d3  # eq. 8
