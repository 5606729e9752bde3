"""A motor by the equations of a direct-current motor, which also describe a brushless one in its torque axis."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import as_scalar, positive


class DcMotor(eqx.Module):
    """V_a = R·i + L·di/dt + k_e·ω,  T_M = k_T·i.

    Raises:
        InputError: a value that is not positive and finite.

    Source: Mauro, Pastorelli, Mohtar (2014), eq. 1.
    """

    resistance: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Resistance R [Ohm]."""
    inductance: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Inductance L [H]."""
    back_emf: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Voltage per speed k_e [Vs/rad]."""
    torque_constant: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Torque per current k_T [Nm/A]; equal to k_e where no power is lost between winding and shaft."""

    def __check_init__(self):
        positive("resistance of the motor", self.resistance, "Ohm")
        positive("inductance of the motor", self.inductance, "H")
        positive("back_emf of the motor", self.back_emf, "Vs/rad")
        positive("torque_constant of the motor", self.torque_constant, "Nm/A")

    def torque(self, current: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        """Torque of a current.

        Args:
            current: torque-generating current i [A].

        Returns:
            T_M [Nm].
        """
        return self.torque_constant * current

    def current_rate(
        self,
        voltage: Float[ArrayLike, "*batch"],
        current: Float[ArrayLike, "*batch"],
        speed: Float[ArrayLike, "*batch"],
    ) -> Float[Array, "*batch"]:
        """Time derivative of the current.

        Args:
            voltage: armature voltage V_a [V].
            current: i [A].
            speed: speed of the motor ω [rad/s].

        Returns:
            di/dt [A/s].
        """
        return jnp.asarray(voltage - self.resistance * current - self.back_emf * speed) / self.inductance
