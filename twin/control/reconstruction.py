"""The table's position from the motor encoders, where there is no linear scale."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import positive
from twin.drives.rack_pinion import RackPinionDrive
from twin.drives.rack_pinion_operation import friction_level


def reconstruct_table_position(
    drive: RackPinionDrive,
    positions: Float[ArrayLike, "2 *batch"],
    forces: Float[ArrayLike, "2 *batch"],
    *,
    width: Float[ArrayLike, ""] = 100.0,
) -> Float[Array, "*batch"]:
    """Table position x_T = Σ w_i·(x_i - δ_i(F_i)), each motor less the deflection of its mesh under its force.

    The deflection has the load-dependent stiffness and half of the play, on the side that the force says. A motor whose
    force is small may lie anywhere in its play; so the weights w_1 = σ((|F_1| - |F_2|)/width), w_2 = σ((|F_2| -
    |F_1|)/width) pass smoothly to the motor that is held against its flank. They add up to one.

    What Leipe et al. give as outlook (section VI): load-dependent stiffness, and smooth switching by two sigmoids.

    Args:
        drive: the drive, for its meshes.
        positions: positions of motor 1 and 2 behind their gearboxes [m].
        forces: forces through the meshes, as `mesh_forces_of_motion` or an observer gives them [N].
        width: difference of the forces over which the weights change [N].

    Raises:
        InputError: if the width is not positive.
    """
    positive("width", width, "N")
    x, f = jnp.asarray(positions), jnp.asarray(forces)
    deflections = [jnp.vectorize(train.mesh.deflection)(f[i]) for i, train in enumerate((drive.train_1, drive.train_2))]
    lead = (jnp.abs(f[0]) - jnp.abs(f[1])) / width
    first, second = jax.nn.sigmoid(lead), jax.nn.sigmoid(-lead)
    return first * (x[0] - deflections[0]) + second * (x[1] - deflections[1])


def mesh_forces_of_motion(
    drive: RackPinionDrive,
    torques: Float[ArrayLike, "2 *batch"],
    velocity: Float[ArrayLike, "*batch"],
    acceleration: Float[ArrayLike, "*batch"],
) -> Float[Array, "2 *batch"]:
    """Forces through the meshes during a motion: motor forces less the motors' inertia and friction [N].

    Args:
        drive: the drive.
        torques: torques of motor 1 and 2 [Nm].
        velocity: set or measured velocity of the table [m/s].
        acceleration: set or measured acceleration [m/s²].

    Raises:
        InputError: if a motor's friction has memory.
    """
    r = drive.travel_per_radian
    tau, v, a = jnp.asarray(torques), jnp.asarray(velocity), jnp.asarray(acceleration)

    def force(train: Any, torque: Array) -> Array:
        friction = friction_level("friction of a motor", train.friction, v / r)
        return (torque - friction - train.inertia * a / r) / r

    return jnp.stack([force(drive.train_1, tau[0]), force(drive.train_2, tau[1])])
