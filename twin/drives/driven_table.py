"""The table of a rack-and-pinion drive, driven by the measured motion of its motors."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from twin._checks import InputError, as_scalar, finite
from twin.drives.rack_pinion import RackPinionDrive
from twin.laws import SecantMesh
from twin.plant import AbstractPlant


class MotorMotion(NamedTuple):
    """Motion of both motors, behind their gearboxes."""

    position_1: Float[Array, ""]
    """Travel of the pitch circle of pinion 1 [m]."""
    velocity_1: Float[Array, ""]
    """Velocity of it [m/s]."""
    position_2: Float[Array, ""]
    """Travel of the pitch circle of pinion 2 [m]."""
    velocity_2: Float[Array, ""]
    """Velocity of it [m/s]."""


class DrivenTableInputs(NamedTuple):
    """Inputs of a table whose motors' motion is known."""

    command: MotorMotion
    """Motion of the motors."""
    load: Float[Array, ""]
    """Process force on the table, positive in the direction of motion [N]."""


class DrivenTableState(NamedTuple):
    """State of a driven table."""

    table_position: Float[Array, ""]
    """Table position x_T [m]."""
    table_velocity: Float[Array, ""]
    """Table velocity v_T [m/s]."""
    table_friction: PyTree[Array]
    """Internal state of the table's friction."""


class DrivenTableOutputs(NamedTuple):
    """What a driven table does."""

    table_position: Float[Array, ""]
    """Table position x_T [m]."""
    table_velocity: Float[Array, ""]
    """Table velocity v_T [m/s]."""
    preload_force: Float[Array, ""]
    """Half the difference of the forces through the meshes [N]."""


class DrivenTable(AbstractPlant):
    """m·ẍ_T = F₁ + F₂ + load - F_f(ẋ_T), with F₁ and F₂ from the meshes between measured motors and the table.

    What moves the motors (controllers, currents, their own friction and inertia) does not enter: a fit to the table's
    motion sees mass, guides and meshes alone. Its meshes must not read the motor's torque, which is not known here:
    `TangentMesh`, not `SecantMesh`, unless the table only carries a drive and is never simulated.

    Raises:
        InputError: when simulated with a mesh that reads the motor's torque.
    """

    drive: RackPinionDrive
    """The drive whose table it is."""
    zero_1: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Position of motor 1, less the table's, in the middle of its play: where its encoder is zero [m]."""
    zero_2: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """The same of motor 2 [m]."""
    initial_position: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Table position at the start [m]."""
    initial_velocity: Float[Array, ""] = eqx.field(converter=as_scalar, default=0.0)
    """Table velocity at the start [m/s]."""

    def __check_init__(self):
        for name, unit in (("zero_1", "m"), ("zero_2", "m"), ("initial_position", "m"), ("initial_velocity", "m/s")):
            finite(name, getattr(self, name), unit)

    def initial_state(self) -> DrivenTableState:
        return DrivenTableState(self.initial_position, self.initial_velocity, self.drive.table_friction.initial_state())

    def rest_inputs(self) -> DrivenTableInputs:
        zero = jnp.zeros(())
        return DrivenTableInputs(MotorMotion(zero, zero, zero, zero), zero)

    def vector_field(self, t: Float[Array, ""], state: Any, inputs: Any) -> DrivenTableState:
        force_1, force_2 = self._forces(state, inputs.command)
        law = self.drive.table_friction
        guides = law.force(state.table_friction, state.table_velocity, state.table_position)
        return DrivenTableState(
            state.table_velocity,
            (force_1 + force_2 + inputs.load - guides) / self.drive.table_mass,
            law.rate(state.table_friction, state.table_velocity),
        )

    def outputs(self, t: Float[Array, ""], state: Any, inputs: Any) -> DrivenTableOutputs:
        force_1, force_2 = self._forces(state, inputs.command)
        return DrivenTableOutputs(state.table_position, state.table_velocity, 0.5 * (force_1 - force_2))

    def _forces(self, state: Any, motion: Any) -> tuple[Array, Array]:
        x, v = state.table_position, state.table_velocity
        one, two = self.drive.train_1.mesh, self.drive.train_2.mesh
        if isinstance(one, SecantMesh) or isinstance(two, SecantMesh):
            raise InputError(
                "A mesh of the driven table is a SecantMesh, whose force depends on the motor's torque; but only the "
                "motors' motion is known here. Use a TangentMesh, or simulate the whole drive."
            )
        return (
            one.force(motion.position_1 - x - self.zero_1, motion.velocity_1 - v, 0.0),
            two.force(motion.position_2 - x - self.zero_2, motion.velocity_2 - v, 0.0),
        )
