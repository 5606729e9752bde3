"""How much preload a drive needs to be stiff under a process force, and what that costs."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, as_scalar, finite, is_concrete, not_negative, positive
from twin.drives.rack_pinion import RackPinionDrive
from twin.drives.rack_pinion_operation import mesh_forces, preloaded_torques

_ACCURACY = 1e-10


class PreloadChoice(NamedTuple):
    """A preload, with what it gives and costs."""

    preload: Float[Array, ""]
    """Preload torque τ_p, half the difference of the motors' torques [Nm]."""
    torques: Float[Array, "2"]
    """Torques of the motors [Nm]."""
    forces: Float[Array, "2"]
    """Forces through the meshes [N]."""
    stiffness: Float[Array, ""]
    """Total stiffness k(F₁) + k(F₂) [N/m]."""
    copper_loss: Float[Array, ""]
    """Heat in both windings R·(τ₁² + τ₂²)/k_t² [W]."""
    extra_loss: Float[Array, ""]
    """Part of it that the same force without preload would not cost [W]."""


def total_stiffness(
    drive: RackPinionDrive,
    preload: Float[ArrayLike, ""],
    *,
    load: Float[ArrayLike, ""] = 0.0,
    velocity: Float[ArrayLike, ""] = 0.0,
) -> Float[Array, ""]:
    """Total stiffness k(F₁) + k(F₂) of a drive that moves evenly (Leipe et al., eq. 4, over all four quadrants) [N/m].

    Args:
        drive: the drive.
        preload: preload torque τ_p [Nm].
        load: process force on the table [N].
        velocity: velocity of the table [m/s].
    """
    forces = mesh_forces(drive, jnp.stack(preloaded_torques(drive, preload, velocity=velocity, load=load)), velocity)
    return drive.train_1.mesh.stiffness(forces[0]) + drive.train_2.mesh.stiffness(forces[1])


def preload_for_stiffness(
    drive: RackPinionDrive,
    stiffness: float,
    *,
    rated_torque: float,
    torque_constant: float,
    resistance: float,
    load: Float[ArrayLike, ""] = 0.0,
    velocity: Float[ArrayLike, ""] = 0.0,
    reserve: float = 50.0,
) -> PreloadChoice:
    """The smallest preload that keeps a stiffness under a process force, with both motors against opposite flanks.

    Along the surface of Leipe et al., fig. 5, in the quadrants where the forces have different signs; differentiable
    with respect to the drive, the load and the velocity.

    Args:
        drive: the drive.
        stiffness: total stiffness wanted [N/m].
        rated_torque: torque that no motor may exceed for long [Nm].
        torque_constant: torque per current k_t [Nm/A].
        resistance: resistance of a winding R [Ohm].
        load: process force on the table, positive in the direction of motion [N].
        velocity: velocity of the table [m/s].
        reserve: force that is to stay on the flank of the motor that carries less [N]. Near zero the laws no longer
            hold: k(F) stays what it is at its width, while flanks in their play have no stiffness at all.

    Raises:
        InputError: a stiffness, torque, constant or resistance that is not positive; a load or velocity that is not
            finite; a negative reserve; a stiffness that not even the rated torque gives; a load that leaves no room
            for a preload. Under a transformation that hides the values, what cannot be is NaN.
    """
    for name, value, unit in (
        ("stiffness", stiffness, "N/m"),
        ("rated_torque", rated_torque, "Nm"),
        ("torque_constant", torque_constant, "Nm/A"),
        ("resistance", resistance, "Ohm"),
    ):
        positive(name, value, unit)
    finite("load", load, "N")
    finite("velocity", velocity, "m/s")
    not_negative("reserve", reserve, "N")
    given = (drive, as_scalar(load), as_scalar(velocity))
    loss = as_scalar(resistance / torque_constant**2)
    least, most, best, choice = _choose(given, as_scalar(stiffness), as_scalar(rated_torque), as_scalar(reserve), loss)
    if is_concrete(least) and is_concrete(most) and float(least) > float(most):
        raise InputError(
            f"The load leaves no room for a preload: {float(least):.3g} Nm are needed to keep both flanks, but only "
            f"{float(most):.3g} Nm are left up to the rated torque. Reduce the load or take a larger motor."
        )
    if is_concrete(best) and float(best) < stiffness:
        raise InputError(
            f"stiffness of {stiffness:.4g} N/m cannot be reached: with the rated torque it is {float(best):.4g} N/m. "
            "Ask for less."
        )
    return choice


@eqx.filter_jit
def _choose(
    given: tuple[RackPinionDrive, Array, Array],
    stiffness: Array,
    rated_torque: Array,
    reserve: Array,
    loss: Array,
) -> tuple[Array, Array, Array, PreloadChoice]:
    """Least and largest preload, stiffness at the latter, and the choice between."""
    drive, load, velocity = given
    r = drive.travel_per_radian
    bare = jnp.stack(preloaded_torques(drive, 0.0, velocity=velocity, load=load))
    through = mesh_forces(drive, bare, velocity)
    # Motor 1 is to be left with the reserve forwards, motor 2 backwards.
    least = r * (reserve + jnp.maximum(-through[0], through[1]))
    most = rated_torque - jnp.max(jnp.abs(bare))
    best = total_stiffness(drive, most, load=load, velocity=velocity)

    def missing(preload: Array, given: tuple) -> Array:
        drive, load, velocity, wanted = given
        return total_stiffness(drive, preload, load=load, velocity=velocity) / wanted - 1

    enough = total_stiffness(drive, least, load=load, velocity=velocity) >= stiffness
    possible = (least <= most) & (best >= stiffness)
    # Where nothing is to be searched for, the search gets something to find: its derivative must stay finite.
    middle = 0.5 * (least + most)
    easy = total_stiffness(drive, middle, load=load, velocity=velocity)
    wanted = jnp.where(enough | ~possible, easy, stiffness)
    solver = optx.Bisection(rtol=_ACCURACY, atol=_ACCURACY, expand_if_necessary=True)
    found = optx.root_find(
        missing, solver, middle, (*given, wanted), options={"lower": least, "upper": most}, throw=False
    ).value
    preload = jnp.where(possible, jnp.where(enough, least, found), jnp.nan)
    torques = bare + jnp.stack([preload, -preload])
    choice = PreloadChoice(
        preload=preload,
        torques=torques,
        forces=mesh_forces(drive, torques, velocity),
        stiffness=total_stiffness(drive, preload, load=load, velocity=velocity),
        copper_loss=loss * jnp.sum(torques**2),
        extra_loss=loss * jnp.sum(torques**2 - bare**2),
    )
    return least, most, best, choice
