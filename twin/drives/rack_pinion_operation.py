"""A rack-and-pinion drive at an operating point: forces, steady motion, response of the table to its motors."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Complex, Float

from twin._checks import InputError
from twin.drives.rack_pinion import RackPinionDrive, RackPinionInputs, RackPinionState, TorquePair
from twin.laws import AbstractFriction, AbstractMesh, AbstractStaticFriction


def mesh_forces(
    drive: RackPinionDrive, torques: Float[ArrayLike, "2 *batch"], velocity: Float[ArrayLike, ""] = 0.0
) -> Float[Array, "2 *batch"]:
    """Forces through the two meshes while the motors run at constant speed: motor forces less the motors' friction [N].

    Args:
        drive: the drive.
        torques: torques of the motors, motor 1 and 2 along the first axis [Nm].
        velocity: velocity of the table [m/s].

    Raises:
        InputError: if a motor's friction has memory.
    """
    tau = jnp.asarray(torques)
    speed = velocity / drive.travel_per_radian
    lost = [friction_level("friction of a motor", train.friction, speed) for train in (drive.train_1, drive.train_2)]
    return jnp.stack([drive.motor_force(tau[i] - lost[i]) for i in range(2)])


def preloaded_torques(
    drive: RackPinionDrive,
    preload: Float[ArrayLike, ""],
    *,
    velocity: Float[ArrayLike, ""] = 0.0,
    load: Float[ArrayLike, ""] = 0.0,
) -> TorquePair:
    """Torques with which the drive moves evenly, half their difference being the preload.

    Args:
        drive: the drive.
        preload: preload torque τ_p [Nm].
        velocity: velocity of the table [m/s].
        load: process force on the table, positive in the direction of motion [N].

    Raises:
        InputError: if a friction law has memory.
    """
    r = drive.travel_per_radian
    motors = sum(
        friction_level("friction of a motor", train.friction, velocity / r) for train in (drive.train_1, drive.train_2)
    )
    guides = friction_level("table_friction", drive.table_friction, velocity)
    mean = 0.5 * (motors + r * (guides - load))
    return TorquePair(jnp.asarray(mean + preload), jnp.asarray(mean - preload))


def steady_motion(
    drive: RackPinionDrive,
    preload: Float[ArrayLike, ""],
    *,
    velocity: Float[ArrayLike, ""] = 0.0,
    load: Float[ArrayLike, ""] = 0.0,
) -> tuple[RackPinionState, RackPinionInputs]:
    """State and inputs with which the drive, preloaded, moves evenly; the table is at zero.

    Args:
        drive: the drive.
        preload: preload torque τ_p [Nm].
        velocity: velocity of the table [m/s].
        load: process force on the table [N].

    Raises:
        InputError: if a friction law has memory.
    """
    torques = preloaded_torques(drive, preload, velocity=velocity, load=load)
    forces, loads = mesh_forces(drive, jnp.stack(torques), velocity), drive.motor_force(jnp.stack(torques))
    r = drive.travel_per_radian
    speed, zero = jnp.asarray(velocity / r), jnp.zeros(())
    state = RackPinionState(
        drive.train_1.mesh.deflection(forces[0], loads[0]) / r,
        drive.train_2.mesh.deflection(forces[1], loads[1]) / r,
        zero,
        speed,
        speed,
        zero + velocity,
        *((),) * 3,
    )
    return state, RackPinionInputs(torques, jnp.asarray(load, dtype=jnp.float64))


def small_signal(mesh: AbstractMesh, force: Float[ArrayLike, ""]) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """Stiffness and damping of a mesh for small motions about a force that rests on it [N/m, Ns/m].

    Args:
        mesh: the mesh.
        force: force through it [N]; the motor's force is the same.
    """
    delta, still, one = mesh.deflection(force), jnp.zeros(()), jnp.ones(())
    stiffness = jax.jvp(lambda x: mesh.force(x, still, force), (delta,), (one,))[1]
    damping = jax.jvp(lambda v: mesh.force(delta, v, force), (still,), (one,))[1]
    return stiffness, damping


def table_response(
    drive: RackPinionDrive,
    forces: Float[ArrayLike, "2"],
    frequency: Float[ArrayLike, "frequencies"],
    *,
    velocity: Float[ArrayLike, ""] = 0.0,
) -> Complex[Array, "2 frequencies"]:
    """Response of the table's velocity to the velocity of each motor, for small motions, whatever controls the motors.

    G_i = (d_i·s + k_i) / (m·s² + (d_1 + d_2 + d_f)·s + k_1 + k_2), s = j·2πf. Where both motors move alike the table
    follows by G_1 + G_2, the G(s) = V_T/V_1 of Leipe et al., section III.

    Args:
        drive: the drive.
        forces: force through each mesh about which it moves [N].
        frequency: frequencies [Hz].
        velocity: velocity at which the slope d_f of the table's friction is taken [m/s].

    Raises:
        InputError: if the friction of the table has memory.
    """
    s = 2j * jnp.pi * jnp.asarray(frequency)
    at = jnp.asarray(forces)
    (k_1, d_1), (k_2, d_2) = small_signal(drive.train_1.mesh, at[0]), small_signal(drive.train_2.mesh, at[1])
    v = jnp.asarray(velocity, dtype=jnp.float64)
    guides = jax.jvp(lambda u: friction_level("table_friction", drive.table_friction, u), (v,), (jnp.ones_like(v),))[1]
    below = drive.table_mass * s**2 + (d_1 + d_2 + guides) * s + k_1 + k_2
    return jnp.stack([(d_1 * s + k_1) / below, (d_2 * s + k_2) / below])


def friction_level(name: str, law: AbstractFriction, velocity: Any) -> Any:
    """Friction of a law without memory at a steady speed [N or Nm].

    Args:
        name: what the law is the friction of, for the message.
        law: the law.
        velocity: speed [m/s or rad/s].

    Raises:
        InputError: if the law has memory.
    """
    if not isinstance(law, AbstractStaticFriction):
        raise InputError(
            f"The {name} is {type(law).__name__}, a law with memory: its level at a steady speed is not known in "
            "closed form. Use a law without memory here, or simulate until the motion is steady."
        )
    return law(velocity)
