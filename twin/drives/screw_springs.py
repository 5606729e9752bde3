"""The springs of a ball screw axis: single ones as in catalogues, and the five that they make in series."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import as_scalar, positive


class PerSpring(NamedTuple):
    """One value for each of the five springs between the bodies of a ball screw axis (Mauro et al., Fig. 2)."""

    shaft: Float[Array, "*batch"]
    """Between motor and screw end, 12T: motor shaft and coupling."""
    torsion: Float[Array, "*batch"]
    """Between screw end and screw, 23T: torsion of end and screw."""
    support: Float[Array, "*batch"]
    """Between screw and ground, 0A: support, bearing, and the stretch of the screw."""
    nut: Float[Array, "*batch"]
    """Between screw and nut, 12A: balls and races."""
    flange: Float[Array, "*batch"]
    """Between nut and slide, 23A: the nut's flange."""


class ScrewShaft(eqx.Module):
    """The screw's shaft, loaded between its fixed bearing and the nut: stiffness falls with the nut's distance.

    A nut beyond either end gives NaN, so that a run in which it leaves the screw is marked as failed.

    Raises:
        InputError: a value that is not positive and finite.
    """

    axial_rigidity: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Young's modulus times section E·A [N]."""
    torsional_rigidity: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Shear modulus times polar moment of the section G·I_p [Nm²]."""
    length: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Usable length: the largest distance of the nut from the fixed bearing [m]."""

    def __check_init__(self):
        positive("axial_rigidity of the screw", self.axial_rigidity, "N")
        positive("torsional_rigidity of the screw", self.torsional_rigidity, "Nm²")
        positive("length of the screw", self.length, "m")

    def axial_stiffness(self, distance: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        """Axial stiffness k_BS^A = E·A/l of the loaded part [N/m].

        Args:
            distance: of the nut from the fixed bearing l [m].
        """
        return self.axial_rigidity / self._on_screw(distance)

    def torsional_stiffness(self, distance: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        """Torsional stiffness k_BS^T = G·I_p/l of the loaded part [Nm/rad].

        Args:
            distance: of the nut from the fixed bearing l [m].
        """
        return self.torsional_rigidity / self._on_screw(distance)

    def _on_screw(self, distance: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        distance = jnp.asarray(distance)
        return jnp.where((distance > 0) & (distance <= self.length), distance, jnp.nan)


class ScrewSprings(eqx.Module):
    """The stiffnesses of the parts of a ball screw axis.

    Raises:
        InputError: a stiffness that is not positive and finite.

    Source: Mauro, Pastorelli, Mohtar (2014), eq. 3, 5, 9.
    """

    motor_shaft: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Motor shaft, in torsion k_M^T [Nm/rad]."""
    coupling: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Coupling ("elastic joint"), in torsion k_EJ^T [Nm/rad]."""
    screw_end: Float[Array, ""] = eqx.field(converter=as_scalar)
    """End journal of the screw, in torsion k_END^T [Nm/rad]."""
    screw: ScrewShaft
    """The screw's shaft, in torsion and axially."""
    support: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Support of the axis, axial k_S^A [N/m]."""
    bearing: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Fixed bearing, axial k_B^A [N/m]."""
    nut: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Balls and races between screw and nut, axial k_12^A [N/m]."""
    flange: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Flange between nut and slide, axial k_23^A [N/m]."""

    def __check_init__(self):
        for name in ("motor_shaft", "coupling", "screw_end"):
            positive(f"stiffness of {name}", getattr(self, name), "Nm/rad")
        for name in ("support", "bearing", "nut", "flange"):
            positive(f"stiffness of {name}", getattr(self, name), "N/m")

    def in_series(self, distance: Float[ArrayLike, ""]) -> PerSpring:
        """Stiffness of the five springs, two of them [Nm/rad], three [N/m].

        Args:
            distance: of the nut from the fixed bearing [m].
        """
        return PerSpring(
            1.0 / (1.0 / self.motor_shaft + 1.0 / self.coupling),  # eq. 3
            1.0 / (1.0 / self.screw_end + 1.0 / self.screw.torsional_stiffness(distance)),  # eq. 5
            1.0 / (1.0 / self.support + 1.0 / self.bearing + 1.0 / self.screw.axial_stiffness(distance)),  # eq. 9
            self.nut,
            self.flange,
        )
