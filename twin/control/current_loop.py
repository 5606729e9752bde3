"""Motor electrics and the current controllers in front of them."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from twin._checks import as_scalar, not_negative, positive
from twin.laws import smooth_clip
from twin.plant import AbstractPlant, told


class CurrentLoopState(NamedTuple):
    """State of a plant behind current loops."""

    plant: PyTree[Array]
    """State of the plant."""
    current: PyTree[Array]
    """Currents, in the structure of the command [A]."""
    integral: PyTree[Array]
    """Integral parts of the current controllers [V]."""


class CurrentLoop(AbstractPlant):
    """A plant whose torques or forces are made by currents: L·i̇ = u - R·i behind a PI controller of each current.

    The command stays a torque or force; over the torque constant it is the set current, and the plant receives the
    constant times the actual current. The amplifier is taken to make up for the voltage that the motion induces.

    Raises:
        InputError: a resistance, inductance, constant, time or limit that is not positive and finite, a negative gain.
    """

    plant: AbstractPlant
    """What the currents drive; its command is a torque or force, or a tree of them."""
    torque_constant: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Torque or force per current k_t [Nm/A or N/A]."""
    resistance: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Resistance of a winding R [Ohm]."""
    inductance: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Inductance of a winding L [H]."""
    gain: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Gain of the current controllers [V/A]."""
    reset_time: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Reset time of the current controllers [s]."""
    voltage_limit: Float[Array, ""] = eqx.field(converter=as_scalar)
    """Largest voltage of the amplifier for the current [V]."""

    def __check_init__(self):
        for name, unit in (
            ("torque_constant", "Nm/A"),
            ("resistance", "Ohm"),
            ("inductance", "H"),
            ("reset_time", "s"),
            ("voltage_limit", "V"),
        ):
            positive(f"{name} of the current loop", getattr(self, name), unit)
        not_negative("gain of the current loop", self.gain, "V/A")

    @staticmethod
    def tuned(
        plant: AbstractPlant,
        *,
        torque_constant: float,
        resistance: float,
        inductance: float,
        bandwidth: float,
        voltage_limit: float,
    ) -> "CurrentLoop":
        """Controllers whose zero takes away the winding's time constant: each loop is then a lag of first order.

        Args:
            plant: what the currents drive.
            torque_constant: k_t [Nm/A or N/A].
            resistance: R [Ohm].
            inductance: L [H].
            bandwidth: corner frequency of the closed loop [Hz].
            voltage_limit: largest voltage [V].

        Raises:
            InputError: a value that is not positive and finite.
        """
        positive("bandwidth of the current loop", bandwidth, "Hz")
        gain = 2 * jnp.pi * bandwidth * inductance
        return CurrentLoop(plant, torque_constant, resistance, inductance, gain, inductance / resistance, voltage_limit)

    def initial_state(self) -> CurrentLoopState:
        rest = self.plant.rest_inputs().command
        current = jax.tree.map(lambda command: command / self.torque_constant, rest)
        return CurrentLoopState(
            self.plant.initial_state(), current, jax.tree.map(lambda i: self.resistance * i, current)
        )

    def rest_inputs(self) -> Any:
        return self.plant.rest_inputs()

    def vector_field(self, t: Float[Array, ""], state: Any, inputs: Any) -> CurrentLoopState:
        error = jax.tree.map(lambda set_, i: set_ / self.torque_constant - i, inputs.command, state.current)
        wanted = jax.tree.map(lambda e, integral: self.gain * e + integral, error, state.integral)
        voltage = jax.tree.map(self._limited, wanted)
        current = jax.tree.map(lambda u, i: (u - self.resistance * i) / self.inductance, voltage, state.current)
        # What the limit took away is taken from the integral, which therefore does not wind up.
        integral = jax.tree.map(lambda e, u, free: (self.gain * e + u - free) / self.reset_time, error, voltage, wanted)
        return CurrentLoopState(self.plant.vector_field(t, state.plant, self._behind(state, inputs)), current, integral)

    def outputs(self, t: Float[Array, ""], state: Any, inputs: Any) -> Any:
        return told(self.plant.outputs(t, state.plant, self._behind(state, inputs)), inputs.command)

    def _limited(self, voltage: Array) -> Array:
        return smooth_clip(voltage, self.voltage_limit)

    def _behind(self, state: Any, inputs: Any) -> Any:
        return inputs._replace(command=jax.tree.map(lambda i: self.torque_constant * i, state.current))
