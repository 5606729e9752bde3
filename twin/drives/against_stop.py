"""A rack-and-pinion drive whose table is held by a stop."""

from typing import Any

import equinox as eqx
from jaxtyping import Array, Float

from twin._checks import as_scalar, not_negative, positive
from twin.drives.rack_pinion import RackPinionDrive, RackPinionInputs, RackPinionState
from twin.plant import AbstractPlant


class AgainstStop(AbstractPlant):
    """The drive with its table clamped to a stiff stop at zero: load - k_s·x_T - d_s·v_T acts on the table.

    Raises:
        InputError: if the stiffness is not positive, or the damping is negative.
    """

    drive: RackPinionDrive
    """The drive."""
    stiffness: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Stiffness of the stop k_s [N/m]."""
    damping: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Damping of the stop d_s [Ns/m]."""

    def __check_init__(self):
        positive("stiffness of the stop", self.stiffness, "N/m")
        not_negative("damping of the stop", self.damping, "Ns/m")

    def initial_state(self) -> RackPinionState:
        return self.drive.initial_state()

    def rest_inputs(self) -> RackPinionInputs:
        return self.drive.rest_inputs()

    def vector_field(self, t: Float[Array, ""], state: Any, inputs: Any) -> RackPinionState:
        held = inputs.load - self.stiffness * state.table_position - self.damping * state.table_velocity
        return self.drive.vector_field(t, state, inputs._replace(load=held))

    def outputs(self, t: Float[Array, ""], state: Any, inputs: Any) -> Any:
        return self.drive.outputs(t, state, inputs)
