"""Evidence from the motion of a table between its measured motors: several records side by side."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.interpolate import CubicSpline

from fitting.residuals.residual import AbstractResidual
from twin._checks import InputError, positive
from twin.drives import DrivenTable, DrivenTableInputs, DrivenTableState, MotorMotion
from twin.record import Record
from twin.references import AbstractReference, SampledReference
from twin.simulation import simulate
from twin.stepping import ConstantSteps

_MOTORS = ("position_1", "position_2")


class MeasuredMotors(AbstractReference):
    """The motion of both motors as recorded; between the samples it is a cubic spline."""

    motor_1: SampledReference
    """Motor 1 behind its gearbox."""
    motor_2: SampledReference
    """Motor 2 behind its gearbox."""

    def __call__(self, t: Any) -> DrivenTableInputs:
        one, two = self.motor_1(t), self.motor_2(t)
        motion = MotorMotion(one.position, one.velocity, two.position, two.velocity)
        return DrivenTableInputs(motion, jnp.zeros(()))

    def switching_times(self) -> Float[Array, " switches"]:
        return self.motor_1.switching_times()


class DrivenTableResidual(AbstractResidual):
    """Simulated minus measured table position, and preload force, over their standard deviations, of each record.

    The model is a `DrivenTable`. It starts from the measured position and velocity of each record; samples before
    `settled` only let what is wrong about this start die away.
    """

    times: Float[Array, "samples"]
    """Times of all records [s]."""
    motors: MeasuredMotors
    """Motion of the motors, records along the first axis of each array."""
    table_position: Float[Array, "records samples"]
    """Measured table positions [m]."""
    table_velocity: Float[Array, "records"]
    """Table velocity at the start of each record [m/s]."""
    preload_force: Float[Array, "records"]
    """Mean over each record, once settled, of half the difference of the motors' forces [N]."""
    position_deviation: Float[Array, ""]
    """Standard deviation of the table position [m]."""
    force_deviation: Float[Array, ""]
    """Standard deviation of the preload force [N]."""
    settled: int = eqx.field(static=True)
    """Samples to leave out at the start of each record."""
    stepping: ConstantSteps = eqx.field(static=True, default_factory=lambda: ConstantSteps(substeps=1))
    """How time is stepped between samples."""

    @staticmethod
    def create(
        records: Sequence[Record],
        travel_per_radian: float,
        *,
        position_deviation: float,
        force_deviation: float,
        settling_time: float = 0.05,
    ) -> "DrivenTableResidual":
        """Evidence from records with the channels position_1, position_2, table_position [m], torque_1, torque_2 [Nm].

        Half the difference of the torques is a force in which the friction of two like motors drops out.

        Args:
            records: records of equal length and sample period, fast enough to follow the motion (ten samples a period).
            travel_per_radian: r of the drive [m/rad].
            position_deviation: standard deviation of the table position [m].
            force_deviation: standard deviation of the mean preload force of a record [N].
            settling_time: part of each record that is not compared [s].

        Raises:
            InputError: no record, records of different lengths or sample times, a missing channel, a deviation that is
                not positive, a settling time as long as the records.
        """
        positive("position_deviation", position_deviation, "m")
        positive("force_deviation", force_deviation, "N")
        if not records:
            raise InputError("There is no record. Give at least one.")
        lengths = {record.times.size for record in records}
        if len(lengths) > 1:
            raise InputError(f"Records have different lengths ({sorted(lengths)} samples). Cut them to the shortest.")
        times = np.asarray(records[0].times) - float(records[0].times[0])
        for record in records:
            own = np.asarray(record.times) - float(record.times[0])
            if not np.allclose(own, times, rtol=0.0, atol=1e-3 * float(records[0].sample_period)):
                raise InputError(
                    f"{record.name} is sampled at other times than {records[0].name}. Give one sample period."
                )
        settled = int(np.searchsorted(times, settling_time))
        if settled >= times.size:
            raise InputError(f"settling_time of {settling_time:g} s is as long as the records. Take a shorter one.")
        motors = [
            MeasuredMotors(*(_spline(times, np.asarray(record.channel(name))) for name in _MOTORS))
            for record in records
        ]
        table = np.stack([np.asarray(record.channel("table_position")) for record in records])
        difference = [0.5 * float(jnp.mean((r.channel("torque_1") - r.channel("torque_2"))[settled:])) for r in records]
        return DrivenTableResidual(
            times=jnp.asarray(times),
            motors=jax.tree.map(lambda *leaves: jnp.stack(leaves), *motors),
            table_position=jnp.asarray(table),
            table_velocity=jnp.asarray(CubicSpline(times, table, axis=1)(0.0, 1)),
            preload_force=jnp.asarray(difference) / travel_per_radian,
            position_deviation=jnp.asarray(position_deviation),
            force_deviation=jnp.asarray(force_deviation),
            settled=settled,
        )

    def __call__(self, model: DrivenTable) -> Float[Array, "residuals"]:
        def one(motors: MeasuredMotors, position: Array, velocity: Array) -> tuple[Array, Array]:
            start = DrivenTableState(position[0], velocity, model.drive.table_friction.initial_state())
            found = simulate(model, motors, self.times, initial_state=start, stepping=self.stepping).outputs
            error = (found.table_position - position)[self.settled :]
            return error, jnp.mean(found.preload_force[self.settled :])

        axes = jax.tree.map(lambda _: 0, self.motors)
        error, force = jax.vmap(one, in_axes=(axes, 0, 0))(self.motors, self.table_position, self.table_velocity)
        return jnp.concatenate(
            [
                error.ravel() / self.position_deviation,
                (force - self.preload_force) / self.force_deviation,
            ]
        )

    @property
    def rows(self) -> int:
        """Length of the residual."""
        records, samples = self.table_position.shape
        return records * (samples - self.settled) + records

    def series(self, values: Float[Array, "residuals"]) -> Float[Array, "records samples"]:
        """The part of a residual that is about table positions, one row for each record.

        Args:
            values: what calling this evidence returned.
        """
        records = self.table_position.shape[0]
        return values[:-records].reshape(records, -1)


def _spline(times: np.ndarray, position: np.ndarray) -> SampledReference:
    spline = CubicSpline(times, position)
    return SampledReference(times, position, spline(times, 1), spline(times, 2))
