"""Identification of a two-mass drive from the frequency responses of its motor and load angle."""

import dataclasses
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from fitting.fit import fit
from fitting.identification.two_mass_start import MeasuredTwoMass, read_two_mass
from fitting.residuals.frequency_response import FrequencyResponseResidual, rest_response
from fitting.result import Estimate, FitResult
from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt
from twin.control import DelayedPlant
from twin.drives import two_mass_modes
from twin.frf import FRF
from twin.parameters import Parameter, ParameterSpace

_OUTPUTS, _INPUTS = ("position", "load_position"), ("command",)


class TwoMassEstimates(NamedTuple):
    """What the estimated parameters of a two-mass drive together mean; the quantities are those of `TwoMassModes`."""

    resonance: Estimate
    """Undamped resonance [Hz]."""
    antiresonance: Estimate
    """Undamped antiresonance of the motor [Hz]."""
    damping_ratio: Estimate
    """Damping ratio of the vibration, friction of both sides included."""
    peak: Estimate
    """Where the motor's angle responds most to its torque [Hz]."""
    dip: Estimate
    """Where the motor's angle responds least to its torque [Hz]."""


@dataclasses.dataclass(frozen=True)
class TwoMassIdentification:
    """A two-mass drive fitted to measured frequency responses."""

    result: FitResult
    """The fit: its model is a `DelayedPlant` around a `TwoMass`."""
    modes: TwoMassEstimates
    """Resonance, antiresonance and damping ratio of the fitted model, with standard errors."""
    start: MeasuredTwoMass
    """The closed-form reading of the measured response, from which the fit started."""

    @property
    def model(self) -> DelayedPlant:
        """The fitted drive behind its dead time."""
        return self.result.model


def two_mass_space(start: DelayedPlant) -> ParameterSpace:
    """Free parameters of a two-mass drive behind a dead time: all but the torque constant, which no FRF shows.

    Inertias and stiffness move on a log scale, damping, frictions and delay on a linear one with a bound at zero.

    Args:
        start: drive with viscous friction on both sides; its values set the scale of the linear parameters.
    """
    drive: Any = start.plant
    critical = 2 * float(jnp.sqrt(drive.stiffness * drive.load_inertia))
    # A round number, so that similar drives share one compiled fit.
    size = 10.0 ** round(np.log10(0.01 * critical))
    return ParameterSpace(
        [
            Parameter("plant.motor_inertia", "kg m²", lower=0.0, scale="log"),
            Parameter("plant.load_inertia", "kg m²", lower=0.0, scale="log"),
            Parameter("plant.stiffness", "Nm/rad", lower=0.0, scale="log"),
            Parameter("plant.damping", "Nms/rad", lower=0.0, size=size),
            Parameter("plant.motor_friction.viscous", "Nms/rad", lower=0.0, size=size),
            Parameter("plant.load_friction.viscous", "Nms/rad", lower=0.0, size=size),
            Parameter("delay", "s", size=1e-4),
        ]
    )


def two_mass_residual(
    measured: FRF,
    *,
    kind: str = "log",
    motor: str = "motor_angle",
    load: str = "load_angle",
    excitation: str = "current",
) -> FrequencyResponseResidual:
    """Evidence about a two-mass drive from its measured responses, weighted by their variance.

    Args:
        measured: response of motor and load angle, with variance; other responses in it are left aside.
        kind: as in `FrequencyResponseResidual`.
        motor: name of the motor's angle.
        load: name of the load's angle.
        excitation: name of the torque, or of a current in proportion to it.

    Raises:
        InputError: unknown names, or a response without a usable variance.
    """
    values = jnp.stack([measured[motor, excitation], measured[load, excitation]])[:, None]
    variance = None
    if measured.variance is not None:
        deviation = [measured.standard_deviation(name, excitation) for name in (motor, load)]
        variance = jnp.stack(deviation)[:, None] ** 2
    chosen = FRF(measured.frequency, values, (motor, load), (excitation,), measured.form, variance)
    return FrequencyResponseResidual(chosen, _OUTPUTS, _INPUTS, kind)


def identify_two_mass(
    measured: FRF,
    *,
    kind: str = "log",
    motor: str = "motor_angle",
    load: str = "load_angle",
    excitation: str = "current",
    solver: BoundedLevenbergMarquardt | None = None,
    max_steps: int = 100,
) -> TwoMassIdentification:
    """Fit inertias, stiffness, damping, viscous friction of both sides and a dead time to measured responses.

    The start is read from the measurement itself (`read_two_mass`). The standard errors are scaled by the residual's
    own variance; they take the lines as independent and a linear drive as true, so that they are lower bounds where a
    nonlinearity is at work.

    Args:
        measured: response of motor and load angle, counted in the same direction, with its variance. Where distortion
            exceeds noise give the total variance (`twin.frf.local_polynomial_variance`): else lines that the model
            cannot meet rule the fit.
        kind: "log" (robust, the default) or "complex", as in `FrequencyResponseResidual`.
        motor: name of the motor's angle.
        load: name of the load's angle.
        excitation: name of the torque, or of a current in proportion to it; inertias, stiffness and frictions are then
            in units of the torque constant.
        solver: settings of the Levenberg-Marquardt solver.
        max_steps: steps after which the fit is given up.

    Returns:
        The fit, and what its parameters mean.

    Raises:
        InputError: unknown names, no usable variance, or a response that is not that of a two-mass drive.
    """
    residual = two_mass_residual(measured, kind=kind, motor=motor, load=load, excitation=excitation)
    start = read_two_mass(measured, motor=motor, load=load, excitation=excitation)
    result = fit(residual, start.model, two_mass_space(start.model), solver=solver, max_steps=max_steps)
    return TwoMassIdentification(result, modes_of(result), start)


def two_mass_response(model: DelayedPlant, frequency: Float[ArrayLike, "frequencies"]) -> FRF:
    """Responses of motor and load angle to the torque, named as in the bench's records.

    Args:
        model: two-mass drive behind a dead time.
        frequency: frequencies [Hz].
    """
    values = _responses(model, jnp.asarray(frequency))
    return FRF(jnp.asarray(frequency), values, ("motor_angle", "load_angle"), ("current",))


def modes_of(result: FitResult) -> TwoMassEstimates:
    """Resonance, antiresonance and damping of a fitted drive, with standard errors by the delta method.

    Parameters on a bound count as known there.

    Args:
        result: fit of a two-mass drive behind a dead time, with friction laws without memory.

    Raises:
        InputError: if a friction law has memory.
    """
    values, slopes = (np.asarray(x) for x in _linearised(result.space, result.model, jnp.asarray(result.values)))
    free = ~result.active
    covariance = slopes[:, free] @ result.covariance[np.ix_(free, free)] @ slopes[:, free].T
    units = ("Hz", "Hz", "1", "Hz", "Hz")
    errors = np.sqrt(np.diag(covariance))
    return TwoMassEstimates(*(Estimate(float(v), float(e), u) for v, e, u in zip(values, errors, units, strict=True)))


@eqx.filter_jit
def _responses(model: DelayedPlant, frequency: Array) -> Array:
    everything = rest_response(model, frequency)
    return jnp.stack([everything[name, _INPUTS[0]] for name in _OUTPUTS])[:, None]


@eqx.filter_jit
def _linearised(space: ParameterSpace, model: DelayedPlant, values: Array) -> tuple[Array, Array]:
    def derived(x: Array) -> tuple[Array, Array]:
        drive: Any = space.with_values(model, x).plant
        modes = jnp.stack(two_mass_modes(drive))
        return modes, modes

    slopes, modes = jax.jacfwd(derived, has_aux=True)(values)
    return modes, slopes
