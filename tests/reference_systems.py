"""Small systems that the tests share: inputs and controllers of their own, drives with known answers."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from twin._checks import as_scalar
from twin.control import AbstractController
from twin.drives import DriveInputs, ServoAxis, TwoMass
from twin.laws import ViscousFriction
from twin.references import AbstractReference


class SineCommand(AbstractReference):
    """Command A·sin(2πft), no load."""

    amplitude: Float[Array, ""]
    frequency: Float[Array, ""]

    def __init__(self, amplitude, frequency):
        self.amplitude, self.frequency = as_scalar(amplitude), as_scalar(frequency)

    def __call__(self, t):
        return DriveInputs(self.amplitude * jnp.sin(2 * jnp.pi * self.frequency * t), jnp.zeros(()))

    def switching_times(self):
        return jnp.zeros(0)


class ConstantInputs(AbstractReference):
    """Command and load that never change."""

    command: Float[Array, ""]
    load: Float[Array, ""]

    def __init__(self, command, load):
        self.command, self.load = as_scalar(command), as_scalar(load)

    def __call__(self, t):
        del t
        return DriveInputs(self.command, self.load)

    def switching_times(self):
        return jnp.zeros(0)


class ContinuousCascade(AbstractController):
    """u = kv·(kp·(q_r - q) + q̇_r - q̇) + ∫ki·(q_r - q)dt."""

    position_gain: Float[Array, ""]
    velocity_gain: Float[Array, ""]
    integral_gain: Float[Array, ""]

    def __init__(self, position_gain, velocity_gain, integral_gain):
        gains = (position_gain, velocity_gain, integral_gain)
        self.position_gain, self.velocity_gain, self.integral_gain = map(as_scalar, gains)

    def initial_state(self):
        return jnp.zeros(())

    def vector_field(self, t, state, reference, measurement):
        return self.integral_gain * (reference.position - measurement.position)

    def command(self, t, state, reference, measurement):
        speed = self.position_gain * (reference.position - measurement.position) + reference.velocity
        return self.velocity_gain * (speed - measurement.velocity) + state


def viscous_axis(**fields):
    """An axis that coasts to a stop with the time constant M/F_v = 0.5 s."""
    return ServoAxis(mass=100.0, friction=ViscousFriction(200.0), **fields)


def two_mass():
    """A lightly damped two-mass drive, resonance 9.5 Hz."""
    return TwoMass(0.02, 0.03, 40.0, 0.02, ViscousFriction(0.01), ViscousFriction(0.02), gain=0.5)


def two_mass_matrices(drive):
    """ẋ = A·x + b·command + e·load for x = (φ₁, φ₂, φ̇₁, φ̇₂), written out by hand."""
    j1, j2, k, d = (float(x) for x in (drive.motor_inertia, drive.load_inertia, drive.stiffness, drive.damping))
    b1, b2 = float(drive.motor_friction.viscous), float(drive.load_friction.viscous)
    a = jnp.array(
        [
            [0, 0, 1, 0],
            [0, 0, 0, 1],
            [-k / j1, k / j1, -(d + b1) / j1, d / j1],
            [k / j2, -k / j2, d / j2, -(d + b2) / j2],
        ]
    )
    return a, jnp.array([0, 0, float(drive.gain) / j1, 0]), jnp.array([0, 0, 0, 1 / j2])
