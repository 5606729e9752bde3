"""The outlook of Leipe et al. made real: the table position from the motor encoders, in moves of the bench."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np

from fitting.identification.leipe import DirectStudy, Validation
from twin.control import mesh_forces_of_motion, reconstruct_table_position


@dataclasses.dataclass(frozen=True)
class Reconstruction:
    """The table position made from the motor encoders during a move (section VI)."""

    times: np.ndarray
    """Times of the move [s]."""
    errors: dict[str, np.ndarray]
    """Estimate less the linear scale, by the name of the estimate [m]."""


def reconstruct(direct: DirectStudy, validation: Validation) -> dict[str, Reconstruction]:
    """The table position from the motor encoders, at 10 % preload and, where flanks let go, at the lowest of the moves.

    Args:
        direct: the direct fits, for the encoders' zeros and the move.
        validation: the identified drive and the validation move.
    """
    zeros, drive = direct.fits.joint.model, validation.drive
    found = {}
    for name, measurement, reference in (
        ("10 % preload", validation.measurement, validation.reference),
        (f"{direct.move_preloads[0]:g} % preload", direct.moves[0], direct.move),
    ):
        # From the preload on, shortly before the move begins.
        record = measurement.record.slice(float(reference.start_time) - 0.1, float(measurement.record.times[-1]))
        motion = jax.vmap(reference)(record.times)
        torques = jnp.stack([record.channel("torque_1"), record.channel("torque_2")])
        forces = mesh_forces_of_motion(drive, torques, motion.velocity, motion.acceleration)
        positions = jnp.stack(
            [record.channel("position_1") - zeros.zero_1, record.channel("position_2") - zeros.zero_2]
        )
        estimates = {
            "mean of the motors": jnp.mean(positions, axis=0),
            "motor 1": positions[0],
            "reconstructed": reconstruct_table_position(drive, positions, forces),
        }
        table = record.channel("table_position")
        errors = {key: np.asarray(value - table) for key, value in estimates.items()}
        found[name] = Reconstruction(np.asarray(record.times), errors)
    return found
