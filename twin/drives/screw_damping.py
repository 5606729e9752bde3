"""Damping of the five springs of a ball screw axis."""

import abc

import equinox as eqx
import jax
from jaxtyping import Array, Float

from twin._checks import as_scalar, not_negative
from twin.drives.screw_springs import PerSpring


class AbstractScrewDamping(eqx.Module):
    """Viscous coefficients beside the five springs."""

    @abc.abstractmethod
    def coefficients(self, stiffness: PerSpring) -> PerSpring:
        """Viscous coefficient of each spring, two [Nms/rad], three [Ns/m].

        Args:
            stiffness: of each spring, two [Nm/rad], three [N/m].
        """


class StructuralDamping(AbstractScrewDamping):
    """Damping in proportion to stiffness, B = b·K.

    Raises:
        InputError: a time that is negative or not finite.

    Source: Mauro, Pastorelli, Mohtar (2014), eq. 19.
    """

    time: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Damping per stiffness b [s]; a mode of natural frequency ω has the damping ratio b·ω/2."""

    def __check_init__(self):
        not_negative("time of the structural damping", self.time, "s")

    def coefficients(self, stiffness: PerSpring) -> PerSpring:
        return jax.tree.map(lambda k: self.time * k, stiffness)


class SpringDampers(AbstractScrewDamping):
    """A free viscous coefficient beside each spring.

    Raises:
        InputError: a coefficient that is negative or not finite.
    """

    shaft: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Motor shaft and coupling β_12^T [Nms/rad]."""
    torsion: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Torsion of the screw β_23^T [Nms/rad]."""
    support: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Support, bearing and screw β_0^A [Ns/m]."""
    nut: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Nut β_12^A [Ns/m]."""
    flange: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Flange β_23^A [Ns/m]."""

    def __check_init__(self):
        for name in PerSpring._fields:
            unit = "Nms/rad" if name in ("shaft", "torsion") else "Ns/m"
            not_negative(f"damping of {name}", getattr(self, name), unit)

    def coefficients(self, stiffness: PerSpring) -> PerSpring:
        return PerSpring(self.shaft, self.torsion, self.support, self.nut, self.flange)
