"""An eight-parameter drive fit: a two-mass drive with friction on both sides in a continuous cascade, simulated."""

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp

from fitting.residuals.residual import AbstractResidual
from fitting.residuals.trajectory import TrajectoryResidual
from tests.reference_systems import ContinuousCascade
from twin.control import ClosedLoop
from twin.drives import TwoMass
from twin.laws import CoulombViscousFriction
from twin.parameters import Parameter, ParameterSpace
from twin.record import Record
from twin.references import JerkLimitedMove
from twin.simulation import simulate
from twin.stepping import ConstantSteps

TRUTH = {
    "plant.motor_inertia": (0.01, "kg m^2"),
    "plant.load_inertia": (0.02, "kg m^2"),
    "plant.stiffness": (400.0, "N m"),
    "plant.damping": (0.05, "N m s"),
    "plant.motor_friction.coulomb": (0.3, "N m"),
    "plant.motor_friction.viscous": (0.01, "N m s"),
    "plant.load_friction.coulomb": (0.5, "N m"),
    "plant.load_friction.viscous": (0.02, "N m s"),
}
"""Chosen values, none measured."""
SPREAD = 5.0
"""Bounds are a factor of this on both sides of the truth."""
WIDTH = 0.05
"""Width of the smoothed sign of the friction [rad/s]."""
GAINS = (40.0, 2.0, 50.0)
"""Position, velocity and integral gain of the cascade."""
DEVIATION = {"position": 1e-4, "load_position": 1e-4}
"""Standard deviation of the noise [rad]."""
PERIOD = 1e-3
"""Between samples [s]."""


class Case(NamedTuple):
    """Evidence, a model and its free parameters."""

    residual: AbstractResidual
    model: Any
    space: ParameterSpace
    throughout: Callable[[np.ndarray], np.ndarray]
    """The residual of a scaled vector by NumPy and SciPy alone."""


def space_around(truth: Mapping[str, tuple[float, str]], spread: float = SPREAD) -> ParameterSpace:
    """Parameters on a log scale, free by a factor on both sides of the truth.

    Args:
        truth: value and unit by path.
        spread: the factor.
    """
    free = [Parameter(path, unit, v / spread, v * spread, scale="log") for path, (v, unit) in truth.items()]
    return ParameterSpace(free)


def drive_case(samples: int = 300, *, seed: int = 1) -> Case:
    """Simulate the record.

    Args:
        samples: of the record.
        seed: of the noise.
    """
    values = [value for value, _ in TRUTH.values()]
    plant = TwoMass(
        *values[:4],
        CoulombViscousFriction(values[4], values[5], WIDTH),
        CoulombViscousFriction(values[6], values[7], WIDTH),
    )
    model = ClosedLoop(plant, ContinuousCascade(*GAINS))
    move = JerkLimitedMove(1.0, 12.0, 300.0, 2e4, start_time=0.01)
    times, stepping = np.arange(samples) * PERIOD, ConstantSteps(substeps=2)
    clean = eqx.filter_jit(simulate)(model, move, jnp.asarray(times), stepping=stepping)
    noise = np.random.default_rng(seed)
    channels = {
        name: np.asarray(clean.channel(name)) + sd * noise.standard_normal(samples) for name, sd in DEVIATION.items()
    }
    record = Record.create(times, channels, dict.fromkeys(channels, "rad"), name="simulated drive")
    wanted = _sampled_reference(move, times)
    measured = [np.asarray(channels[name]) for name in DEVIATION]
    return Case(
        TrajectoryResidual.create(record, move, DEVIATION, stepping=stepping),
        model,
        space_around(TRUTH),
        lambda vector: _scipy_residual(wanted, times, measured, vector),
    )


def _scipy_residual(wanted: Callable, times: np.ndarray, measured: list[np.ndarray], vector: np.ndarray) -> np.ndarray:
    """The same residual by `scipy.integrate.solve_ivp`, written out in plain Python."""
    j1, j2, k, d, c1, v1, c2, v2 = np.exp(vector).tolist()
    kp, kv, ki = GAINS

    def rate(t: float, y: np.ndarray) -> tuple[float, ...]:
        q1, q2, w1, w2, total = y.tolist()
        position, velocity = wanted(t)
        command = kv * (kp * (position - q1) + velocity - w1) + total
        shaft = k * (q1 - q2) + d * (w1 - w2)
        a1 = (command - shaft - c1 * _sign(w1) - v1 * w1) / j1
        a2 = (shaft - c2 * _sign(w2) - v2 * w2) / j2
        return w1, w2, a1, a2, ki * (position - q1)

    end = float(times[-1])
    solution = solve_ivp(rate, (0.0, end), np.zeros(5), t_eval=times, rtol=1e-6, atol=1e-9, max_step=5e-3)
    parts = [
        (solution.y[i] - channel) / sd for i, channel, sd in zip((0, 1), measured, DEVIATION.values(), strict=True)
    ]
    return np.concatenate(parts)


def _sign(w: float) -> float:
    return w / math.sqrt(w * w + WIDTH * WIDTH)


def _sampled_reference(move: JerkLimitedMove, times: np.ndarray) -> Callable:
    """Position and velocity of the move, from a fine table: calling JAX in a right-hand side would not be fair."""
    import jax

    fine = np.linspace(0, float(times[-1]), 4 * times.size)
    points = jax.vmap(move)(jnp.asarray(fine))
    position, velocity, step = np.asarray(points.position).tolist(), np.asarray(points.velocity).tolist(), fine[1]

    def wanted(t: float) -> tuple[float, float]:
        at = min(int(t / step), len(position) - 2)
        share = t / step - at
        return (
            position[at] + share * (position[at + 1] - position[at]),
            velocity[at] + share * (velocity[at + 1] - velocity[at]),
        )

    return wanted
