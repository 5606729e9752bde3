"""What a measured two-mass response says in closed form: its two frequencies, inertias, stiffness, friction, delay.

With G₁ and G₂ the responses of motor and load angle to the torque, behind a dead time τ, and little damping:

    G₁/G₂ = 1 + (J₂s² + b₂s)/(k + ds): the real part falls as 1 - (f/f_a)², whatever the excitation and the delay;
    e^{-jωτ}/(G₁ - G₂) = k(1 + J₁/J₂) - J₁ω² + ...: zero at the resonance f_r, with slope -J₁ over ω²;
    -ω²(J₁G₁ + J₂G₂) = e^{-jωτ}/(1 + b/(J·jω)): the rigid body, whose phase gives delay and friction.

All are straight lines, fitted by linear least squares; they start the fit, and are the data's own resonances.
"""

from typing import NamedTuple

import numpy as np

from fitting.result import Estimate
from twin._checks import InputError
from twin.control import DelayedPlant
from twin.drives import TwoMass
from twin.frf import FRF
from twin.laws import ViscousFriction

# The lines of the regressions: wide enough for a coarse grid of lines, narrow enough to keep to the two frequencies.
_BELOW_ANTIRESONANCE = 1 / 2
_ABOVE_RESONANCE = 4 / 3
_LEAST_LINES = 4


class MeasuredTwoMass(NamedTuple):
    """Closed-form reading of a measured two-mass response."""

    resonance: Estimate
    """Undamped resonance f_r [Hz], with the standard error of its regression."""
    antiresonance: Estimate
    """Undamped antiresonance f_a [Hz], with the standard error of its regression."""
    model: DelayedPlant
    """Two-mass drive behind a dead time with these frequencies: a start for a fit."""


def read_two_mass(
    measured: FRF, *, motor: str = "motor_angle", load: str = "load_angle", excitation: str = "current"
) -> MeasuredTwoMass:
    """Read resonance, antiresonance and starting values from a measured response, without iteration from a guess.

    Args:
        measured: response of motor and load angle, counted in the same direction.
        motor: name of the motor's angle.
        load: name of the load's angle.
        excitation: name of the torque, or of a current in proportion to it; inertias are then per torque constant.

    Returns:
        The two frequencies with their standard errors, and a drive with viscous friction on both sides and a delay.

    Raises:
        InputError: unknown names, fewer than 4 lines around the two frequencies, or a response that is not that of a
            two-mass drive: no antiresonance in range, or a resonance that does not lie above it.
    """
    lines = _Lines(
        np.asarray(measured.frequency),
        np.asarray(measured[motor, excitation]),
        np.asarray(measured[load, excitation]),
    )
    rough = _read(lines, np.ones(lines.frequency.size, dtype=bool), 0.0)
    # Now the lines around both frequencies alone, and with the delay taken out.
    band = (lines.frequency >= _BELOW_ANTIRESONANCE * rough.antiresonance.value) & (
        lines.frequency <= _ABOVE_RESONANCE * rough.resonance.value
    )
    if np.count_nonzero(band) < _LEAST_LINES:
        raise InputError(
            f"Only {np.count_nonzero(band)} lines lie around the antiresonance at {rough.antiresonance.value:g} Hz and "
            f"the resonance at {rough.resonance.value:g} Hz, but {_LEAST_LINES} are needed. Measure more lines there."
        )
    return _read(lines, band, float(rough.model.delay))


class _Lines(NamedTuple):
    """Responses of motor and load over frequency [Hz]."""

    frequency: np.ndarray
    motor: np.ndarray
    load: np.ndarray


def _read(lines: _Lines, band: np.ndarray, delay: float) -> MeasuredTwoMass:
    """The regressions over the lines of a band and the rigid body's phase over all, given an idea of the delay."""
    frequency, g1, g2 = lines
    omega = 2 * np.pi * frequency
    ratio = g1 / g2
    antiresonance = _root("antiresonance", frequency[band], ratio.real[band])
    twist = np.exp(-1j * omega * delay) / (g1 - g2)
    resonance = _root("resonance", frequency[band], twist.real[band])
    inertia = -float(_line(omega[band] ** 2, twist.real[band])[0][1])
    split = (resonance.value / antiresonance.value) ** 2 - 1
    if not (split > 0 and inertia > 0):
        raise InputError(
            f"The resonance reads {resonance.value:g} Hz and the antiresonance {antiresonance.value:g} Hz, but in "
            "a two-mass drive the resonance lies above. Check the signs of the two angles and which is the motor's."
        )
    load_inertia = inertia * split
    rigid = -(omega**2) * (inertia * g1 + load_inertia * g2)
    delay, friction = _delay_and_friction(omega, rigid, inertia + load_inertia)
    stiffness = load_inertia * (2 * np.pi * antiresonance.value) ** 2
    load_friction, damping = _load_friction_and_damping(omega[band], ratio.imag[band], stiffness, load_inertia)
    drive = TwoMass(
        inertia,
        load_inertia,
        stiffness,
        damping,
        ViscousFriction(max(friction - load_friction, 0.1 * friction)),
        ViscousFriction(load_friction),
    )
    return MeasuredTwoMass(resonance, antiresonance, DelayedPlant(drive, delay))


def _line(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Intercept and slope by least squares, and their covariance from the residual."""
    basis = np.stack([np.ones_like(x), x / x.max()], axis=1)
    coefficients = np.linalg.lstsq(basis, y, rcond=None)[0]
    residual = y - basis @ coefficients
    covariance = np.linalg.inv(basis.T @ basis) * (residual @ residual) / max(y.size - 2, 1)
    units = np.array([1.0, 1 / x.max()])
    return coefficients * units, covariance * np.outer(units, units)


def _root(name: str, frequency: np.ndarray, values: np.ndarray) -> Estimate:
    """Where a + c·f² vanishes, with its standard error."""
    (a, c), covariance = _line(frequency**2, values)
    if not -a / c > 0:
        raise InputError(
            f"No {name} in the measured response: the regression over {frequency[0]:g} to {frequency[-1]:g} Hz has no "
            "zero. Check the signs of the two angles and that the lines cover the resonance."
        )
    root = np.sqrt(-a / c)
    gradient = np.array([-1 / c, a / c**2]) / (2 * root)
    return Estimate(float(root), float(np.sqrt(gradient @ covariance @ gradient)), "Hz")


def _delay_and_friction(omega: np.ndarray, rigid: np.ndarray, inertia: float) -> tuple[float, float]:
    """Phase of the rigid body: -ω·τ + b/(J·ω)."""
    basis = np.stack([-omega, 1 / omega], axis=1)
    scale = np.abs(basis).max(axis=0)
    delay, decay = np.linalg.lstsq(basis / scale, np.unwrap(np.angle(rigid)), rcond=None)[0] / scale
    return float(delay), float(max(decay, 1e-6 * omega[0]) * inertia)


def _load_friction_and_damping(
    omega: np.ndarray, imaginary: np.ndarray, stiffness: float, inertia: float
) -> tuple[float, float]:
    """Im(G₁/G₂) = b₂·ω/k + d·J₂·ω³/k², each kept above a millionth of the critical damping."""
    basis = np.stack([omega / stiffness, inertia * omega**3 / stiffness**2], axis=1)
    scale = np.abs(basis).max(axis=0)
    friction, damping = np.linalg.lstsq(basis / scale, imaginary, rcond=None)[0] / scale
    least = 1e-6 * 2 * np.sqrt(stiffness * inertia)
    return float(max(friction, least)), float(max(damping, least))
