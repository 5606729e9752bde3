"""The linear model of whatever a study has, and its natural frequencies and damping ratios.

A sharp friction blocks an axis at rest, and its slope there is nothing but the width by which it was smoothed. The
linear model is therefore one of a drive that moves: at a speed that is given, or so fast that of friction only the
viscous part is left. A preloaded drive is taken at its preload.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError
from twin.control import DelayedPlant, FrictionSlope, SampledLoop
from twin.drives import RackPinionDrive
from twin.drives.friction_slope import friction_slope
from twin.drives.rack_pinion_operation import steady_motion
from twin.frf import FRF
from twin.laws import AbstractFriction, AbstractStaticFriction
from twin.linear import StateSpace, frequency_response, linearise
from twin.modal import damped_modes
from twin.plant import AbstractPlant

# Poles slower than this share of the fastest are rigid-body motion or integrators, not vibrations.
_RIGID = 1e-6
# Where nothing is said, friction is that of a motion this many of its widths fast.
_FAST = 1e4


class VibrationModes(NamedTuple):
    """Vibrations of a linear model, the slowest first; NaN fills up where poles are no vibrations."""

    frequency: Float[Array, "modes"]
    """Undamped natural frequencies |s|/2π [Hz]."""
    damping_ratio: Float[Array, "modes"]
    """Damping ratios -Re(s)/|s| [-]."""


class OperatingPoint(NamedTuple):
    """Where a model is linearised."""

    speed: float | None = None
    """Speed of every friction law [m/s or rad/s]; None for a fast motion."""
    preload: float = 0.0
    """Preload torque, for drives that have one [Nm]."""


class MovingResponse(NamedTuple):
    """Frequency response of a model at an operating point, as a function of model and frequencies."""

    at: OperatingPoint
    """The operating point."""

    def __call__(self, model: Any, frequency: Float[ArrayLike, "frequencies"]) -> FRF:
        """The response of all outputs to all inputs.

        Args:
            model: as in `linear_model`.
            frequency: frequencies [Hz].

        Raises:
            InputError: a model that cannot be linearised.
        """
        return frequency_response(linear_model(model, self.at), jnp.asarray(frequency))


def linear_model(model: Any, at: OperatingPoint | None = None) -> StateSpace:
    """A model in motion, as far as it is continuous: of a sampled loop its drive.

    Args:
        model: a plant, a loop, or a plant behind a delay.
        at: operating point.

    Raises:
        InputError: a model that cannot be linearised.
    """
    at = at or OperatingPoint()
    delay = model.delay if isinstance(model, DelayedPlant) else 0.0
    plant = model.plant if isinstance(model, SampledLoop | DelayedPlant) else model
    if not isinstance(plant, AbstractPlant):
        raise InputError(f"{type(model).__name__} is no drive: it has no frequency response and no modes.")
    if isinstance(plant, RackPinionDrive):
        state, inputs = steady_motion(plant, at.preload, velocity=0.0 if at.speed is None else at.speed)
        return linearise(_straight(plant, at.speed), state, inputs, delay=delay)
    return linearise(_straight(plant, at.speed), delay=delay)


def elastic_modes(model: Any, at: OperatingPoint | None = None) -> VibrationModes:
    """Vibrations of a model.

    Args:
        model: as in `linear_model`.
        at: operating point.

    Raises:
        InputError: a model that cannot be linearised.
    """
    at = at or OperatingPoint()
    plant = model.plant if isinstance(model, SampledLoop | DelayedPlant) else model
    if hasattr(plant, "second_order"):
        # The mechanics alone: the electrics of a motor add poles that are no modes of the structure.
        found = damped_modes(_straight(plant, at.speed).second_order())
        kept = found.oscillating
        order = jnp.argsort(jnp.where(kept, found.frequency, jnp.inf))
        return VibrationModes(
            jnp.where(kept, found.frequency, jnp.nan)[order], jnp.where(kept, found.damping_ratio, jnp.nan)[order]
        )
    poles = jnp.linalg.eigvals(linear_model(model, at).a)
    size = jnp.abs(poles)
    vibrates = (jnp.imag(poles) > 1e-9 * size) & (size > _RIGID * jnp.max(size))
    order = jnp.argsort(jnp.where(vibrates, size, jnp.inf))[: max(1, poles.size // 2)]
    chosen = jnp.where(vibrates[order], poles[order], jnp.nan)
    return VibrationModes(jnp.abs(chosen) / (2 * jnp.pi), -jnp.real(chosen) / jnp.abs(chosen))


def _straight(plant: Any, speed: float | None) -> Any:
    """The plant with every friction law replaced by its slope."""
    return jax.tree.map(lambda x: _slope_of(x, speed) if _is_law(x) else x, plant, is_leaf=_is_law)


def _slope_of(law: AbstractFriction, speed: float | None) -> FrictionSlope:
    if not isinstance(law, AbstractStaticFriction):
        return FrictionSlope(getattr(law, "viscous", 0.0))
    fast = _FAST * getattr(law, "width", 1.0) if speed is None else speed
    return FrictionSlope(friction_slope("friction", law, fast))


def _is_law(x: object) -> bool:
    return isinstance(x, AbstractFriction)
