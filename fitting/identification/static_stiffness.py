"""Stiffness and play of a drive train from a slow ramp of torque against a stop."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from fitting.fit import fit
from fitting.residuals.residual import AbstractResidual
from fitting.result import FitResult
from twin._checks import InputError, as_array, as_scalar, positive
from twin.drives import RackPinionDrive
from twin.laws import AbstractMesh
from twin.parameters import Parameter, ParameterSpace
from twin.record import Record

LEAST_ORDER = 1.01
"""Lower bound of k2: the tangent reading needs it above 1."""


class StaticMesh(eqx.Module):
    """A mesh under the torque of its motor, at rest."""

    mesh: AbstractMesh
    """The mesh."""
    friction: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Friction of the motor, which holds against the direction in which it creeps [Nm]."""
    zero: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Deflection that the encoders show in the middle of the play [m]."""
    travel_per_radian: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Travel of the table per radian of the motor r [m/rad]."""

    def deflection(
        self, torque: Float[ArrayLike, "points"], direction: Float[ArrayLike, "points"]
    ) -> Float[Array, "points"]:
        """Deflection that the encoders show [m].

        Args:
            torque: motor torques [Nm].
            direction: +1 where the torque rises, -1 where it falls.
        """
        forces = (jnp.asarray(torque) - self.friction * jnp.asarray(direction)) / self.travel_per_radian
        return self.zero + jax.vmap(self.mesh.deflection)(forces)


class StaticDeflectionResidual(AbstractResidual):
    """Modelled minus measured deflection over its standard deviation; the model is a `StaticMesh`."""

    torque: Float[Array, "_"] = eqx.field(converter=as_array)
    """Motor torques [Nm]."""
    direction: Float[Array, "_"] = eqx.field(converter=as_array)
    """+1 where the torque rises, -1 where it falls."""
    measured: Float[Array, "_"] = eqx.field(converter=as_array)
    """Measured deflections [m]."""
    deviation: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Standard deviation of the deflections [m]."""

    def __call__(self, model: StaticMesh) -> Float[Array, "residuals"]:
        return (model.deflection(self.torque, self.direction) - self.measured) / self.deviation


def identify_static_stiffness(
    record: Record,
    drive: RackPinionDrive,
    *,
    motor: int = 1,
    least_torque: float,
    deviation: float = 1e-7,
    points: int = 400,
) -> FitResult:
    """k1, k2, play and the motor's friction from a torque that goes slowly up and down on both sides.

    The table rests against a stop (Leipe et al., section III, after Engelberth et al. 2015). Near zero torque the
    pinion is somewhere in its play; that part is left out. The model of the result is a `StaticMesh`.

    Args:
        record: channels position_1 or position_2 and table_position [m], torque_1 or torque_2 [Nm]. Averages over
            equal parts of it are compared.
        drive: the drive whose mesh is the start.
        motor: 1 or 2.
        least_torque: magnitude of the torque below which samples are left out [Nm].
        deviation: standard deviation of the averaged deflections [m].
        points: parts of the record that are averaged.

    Raises:
        InputError: another motor than 1 or 2, a missing channel, a record that stays on one side of the play, too few
            points, or too few of them above the least torque.
    """
    if motor not in (1, 2):
        raise InputError(f"motor must be 1 or 2, but is {motor}. Say which of the two motors drove.")
    positive("least_torque", least_torque, "Nm")
    positive("deviation", deviation, "m")
    if points < 8:
        raise InputError(f"points must be at least 8, but is {points}. Five parameters are fitted to them.")
    torque = np.asarray(record.channel(f"torque_{motor}"))
    apart = np.asarray(record.channel(f"position_{motor}") - record.channel("table_position"))
    size = max(1, torque.size // points)
    whole = torque.size // size * size
    torque = torque[:whole].reshape(-1, size).mean(axis=1)
    apart = apart[:whole].reshape(-1, size).mean(axis=1)
    direction = np.sign(np.gradient(torque))
    # Where the ramp turns, the friction turns too, and is neither one nor the other.
    turning = np.convolve(np.abs(np.diff(direction, prepend=direction[0])), np.ones(5), mode="same") > 0
    used = (np.abs(torque) >= least_torque) & ~turning
    if np.count_nonzero(used) < 8 or np.ptp(np.sign(torque[used])) < 2:
        raise InputError(
            f"{record.name} has {np.count_nonzero(used)} points above {least_torque:g} Nm, or on one side only. Ramp "
            "the torque to both sides, and lower least_torque."
        )
    train = drive.train_1 if motor == 1 else drive.train_2
    start = StaticMesh(train.mesh, 0.0, float(np.mean(apart[used])), drive.travel_per_radian)
    space = ParameterSpace(
        [
            Parameter("mesh.stiffness.k1", "N/m", lower=0.0, scale="log"),
            Parameter("mesh.stiffness.k2", "1", lower=LEAST_ORDER, scale="log"),
            Parameter("mesh.backlash.play", "m", lower=0.0, size=1e-5),
            Parameter("friction", "N m", size=0.1),
            Parameter("zero", "m", size=1e-5),
        ]
    )
    evidence = StaticDeflectionResidual(torque[used], direction[used], apart[used], deviation)
    return fit(evidence, start, space)
