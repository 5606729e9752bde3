"""Another eight-parameter drive fit: a two-mass drive behind a dead time, from its measured frequency responses."""

import jax.numpy as jnp
import numpy as np

from fitting.residuals.frequency_response import FrequencyResponseResidual, rest_response
from tests.benchmarks.drive_case import Case, space_around
from twin.control import DelayedPlant
from twin.drives import TwoMass
from twin.frf import FRF
from twin.laws import ViscousFriction

TRUTH = {
    "plant.motor_inertia": (0.01, "kg m^2"),
    "plant.load_inertia": (0.02, "kg m^2"),
    "plant.stiffness": (400.0, "N m"),
    "plant.damping": (0.05, "N m s"),
    "plant.motor_friction.viscous": (0.01, "N m s"),
    "plant.load_friction.viscous": (0.02, "N m s"),
    "plant.gain": (0.8, "N m/A"),
    "delay": (4e-4, "s"),
}
"""Chosen values, none measured."""
OUTPUTS, INPUTS = ("position", "load_position"), ("command", "load")
RELATIVE = 0.02
"""Standard deviation of the noise, relative to the response."""


def frequency_case(lines: int = 100, *, seed: int = 1) -> Case:
    """Simulate the responses of both angles to current and load torque.

    Args:
        lines: frequencies.
        seed: of the noise.
    """
    j1, j2, k, d, v1, v2, gain, delay = (value for value, _ in TRUTH.values())
    model = DelayedPlant(TwoMass(j1, j2, k, d, ViscousFriction(v1), ViscousFriction(v2), gain), delay)
    frequency = np.geomspace(1.0, 200.0, lines)
    response = rest_response(model, frequency)
    pick = np.ix_([response.outputs.index(n) for n in OUTPUTS], [response.inputs.index(n) for n in INPUTS])
    clean = np.asarray(response.values)[pick]
    deviation = RELATIVE * np.abs(clean)
    rng = np.random.default_rng(seed)
    noise = (rng.standard_normal(clean.shape) + 1j * rng.standard_normal(clean.shape)) / np.sqrt(2)
    measured = FRF(
        jnp.asarray(frequency),
        jnp.asarray(clean + deviation * noise),
        OUTPUTS,
        INPUTS,
        "ratio",
        jnp.asarray(deviation**2),
    )
    residual = FrequencyResponseResidual(measured, kind="log")
    return Case(residual, model, space_around(TRUTH), lambda vector: _scipy_residual(measured, vector))


def _scipy_residual(measured: FRF, vector: np.ndarray) -> np.ndarray:
    """The same residual in NumPy."""
    j1, j2, k, d, v1, v2, gain, delay = np.exp(vector)
    s = 2j * np.pi * np.asarray(measured.frequency)
    coupling = k + s * d
    motor, load = j1 * s**2 + s * v1 + coupling, j2 * s**2 + s * v2 + coupling
    lag = np.exp(-delay * s) / (motor * load - coupling**2)
    response = np.asarray([[gain * load * lag, coupling * lag], [gain * coupling * lag, motor * lag]])
    values = np.asarray(measured.values)
    spread = np.sqrt(np.asarray(measured.variance) / 2) / np.abs(values)
    error = np.log(response / values) / spread
    return np.concatenate([error.real.ravel(), error.imag.ravel()])
