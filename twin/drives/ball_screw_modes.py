"""Modal analysis of a ball screw axis: damping from a ratio, deformation of the springs."""

from collections.abc import Iterable
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, not_negative
from twin.drives.ball_screw import BallScrewAxis
from twin.drives.screw_damping import StructuralDamping
from twin.drives.screw_springs import PerSpring
from twin.modal import Elasticities, elasticities, modes

STIFFNESSES = (
    "springs.motor_shaft",
    "springs.coupling",
    "springs.screw_end",
    "springs.screw.axial_rigidity",
    "springs.screw.torsional_rigidity",
    "springs.support",
    "springs.bearing",
    "springs.nut",
    "springs.flange",
)
"""Paths of everything that is stiff in a ball screw axis."""
INERTIAS = ("motor_inertia", "end_inertia", "screw_inertia", "screw_mass", "nut_mass", "slide_mass")
"""Paths of the masses and inertias of a ball screw axis."""


class SpringDeformations(NamedTuple):
    """How far a mode deforms each spring."""

    raw: PerSpring
    """Δ₁₂ᵀ and Δ₂₃ᵀ [rad], Δ₀ᴬ, Δ₁₂ᴬ and Δ₂₃ᴬ [m], each times the mode's amplitude."""
    axial: PerSpring
    """The same as travel of the slide: twists times h [m], so that all five can be compared."""


def structural_damping(
    axis: BallScrewAxis,
    ratio: Float[ArrayLike, ""] = 0.03,
    mode: int = 1,
    *,
    nut_position: Float[ArrayLike, ""] | None = None,
) -> BallScrewAxis:
    """The axis with damping in proportion to stiffness, b = 2ζ/ω, such that one mode has a given damping ratio.

    Args:
        axis: ball screw axis; what damps its springs is replaced.
        ratio: damping ratio ζ [-].
        mode: which mode, 1 the first with a frequency above zero.
        nut_position: distance of the nut from the fixed bearing [m]; that at mid-stroke if not given.

    Raises:
        InputError: a ratio that is negative or not finite, a mode that is not 1 to 5, a nut outside the screw.

    Source: Mauro, Pastorelli, Mohtar (2014), eq. 21.
    """
    not_negative("ratio", ratio)
    omega = 2 * jnp.pi * modes(axis.second_order(nut_position)).frequency[_elastic(mode)]
    return eqx.tree_at(lambda a: a.damping, axis, StructuralDamping(2 * jnp.asarray(ratio) / omega))


def spring_deformations(
    axis: BallScrewAxis, mode: int = 1, *, nut_position: Float[ArrayLike, ""] | None = None
) -> SpringDeformations:
    """Deformation of the five springs in a mass-normalised mode, signed; differentiable.

    Args:
        axis: ball screw axis.
        mode: which mode, 1 the first with a frequency above zero.
        nut_position: distance of the nut from the fixed bearing [m]; that at mid-stroke if not given.

    Raises:
        InputError: a mode that is not 1 to 5, a nut outside the screw.

    Source: Mauro, Pastorelli, Mohtar (2014), Fig. 9.
    """
    shape: Float[Array, "6"] = modes(axis.second_order(nut_position)).shapes[:, _elastic(mode)]
    motor, end, screw, shift, nut, slide = shape
    h = axis.travel_per_radian
    raw = PerSpring(motor - end, end - screw, shift, shift + h * screw - nut, nut - slide)
    return SpringDeformations(raw, raw._replace(shaft=h * raw.shaft, torsion=h * raw.torsion))


def screw_elasticities(
    axis: BallScrewAxis,
    paths: Iterable[str] = STIFFNESSES + INERTIAS,
    *,
    nut_position: Float[ArrayLike, ""] | None = None,
) -> Elasticities:
    """Elasticity d ln f / d ln p of the six natural frequencies to the axis's parameters.

    Args:
        axis: ball screw axis.
        paths: dotted paths of the parameters; all stiffnesses, masses and inertias if not given.
        nut_position: distance of the nut from the fixed bearing [m]; that at mid-stroke if not given.

    Raises:
        InputError: a path that the axis does not have, a nut outside the screw.
    """
    return elasticities(axis, paths, system=lambda a: a.second_order(nut_position))


def lumped_elasticities(axis: BallScrewAxis, *, nut_position: Float[ArrayLike, ""] | None = None) -> Elasticities:
    """Elasticity of the six natural frequencies to the five springs k₁₂ᵀ, k₂₃ᵀ, k₀ᴬ, k₁₂ᴬ, k₂₃ᴬ.

    Args:
        axis: ball screw axis.
        nut_position: distance of the nut from the fixed bearing [m]; that at mid-stroke if not given.

    Raises:
        InputError: a nut outside the screw.
    """
    return elasticities(
        axis.stiffness(nut_position), PerSpring._fields, system=lambda k: axis.second_order(stiffness=k)
    )


def _elastic(mode: int) -> int:
    if mode not in (1, 2, 3, 4, 5):
        raise InputError(f"mode must be 1 to 5, the elastic modes of six bodies, but is {mode!r}.")
    # Mode 0 is the rigid body.
    return int(mode)
