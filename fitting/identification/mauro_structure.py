"""Modal analysis of the axis of Mauro et al.: sections 4, 5 and 7, fig. 9 and 10."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.identification.mauro_table_axis import table_axis
from twin.drives import BallScrewAxis, PerSpring, lumped_elasticities, spring_deformations
from twin.modal import Elasticities, modes
from twin.sweep import Sweep, sweep

# Step of the central differences that elasticities are checked against, with one extrapolation.
_STEP = 2e-3


class FirstFrequency(eqx.Module):
    """First natural frequency above zero as a function of the five springs of matrix 18."""

    axis: BallScrewAxis
    """The axis, whose own stiffness is not used."""

    def __call__(self, stiffness: PerSpring) -> dict[str, Float[Array, ""]]:
        return {"first_frequency": modes(self.axis.second_order(stiffness=stiffness)).frequency[1]}


class Structure(NamedTuple):
    """What the modal analysis of the axis says."""

    axis: BallScrewAxis
    """The axis, all its values chosen."""
    frequencies: np.ndarray
    """Natural frequencies (6,) [Hz]; the first is that of the rigid body, zero."""
    damping_ratios: np.ndarray
    """Damping ratios (6,) [-]."""
    deformations: dict[str, float]
    """Deformation of the five springs in the first elastic mode, in the axial measure, over the largest [-]; fig. 9."""
    elasticities: Elasticities
    """d ln f / d ln k of all modes to the five springs."""
    closed_form: np.ndarray
    """The same of the first elastic mode by k·Δ²/(2·ω²), from the deformations (5,)."""
    differences: np.ndarray
    """The same by central differences (5,)."""
    support_sweep: Sweep
    """First frequency over the support's stiffness, 0.5 to 1.5 of its value; fig. 10."""


def study_structure(axis: BallScrewAxis | None = None) -> Structure:
    """Modal analysis of an axis.

    Args:
        axis: ball screw axis; that of the paper, completed by chosen values, if not given.
    """
    axis = table_axis() if axis is None else axis
    found, stiffness = modes(axis.second_order()), axis.stiffness()
    deformations = spring_deformations(axis)
    size = {name: abs(float(value)) for name, value in deformations.axial._asdict().items()}
    largest = max(size.values())
    springs, raw = np.asarray(jnp.stack(stiffness)), np.asarray(jnp.stack(deformations.raw))
    omega = 2 * np.pi * float(found.frequency[1])
    frequency = eqx.filter_jit(FirstFrequency(axis))

    def logarithm(name: str, factor: float) -> float:
        varied = stiffness._replace(**{name: getattr(stiffness, name) * factor})
        return float(jnp.log(frequency(varied)["first_frequency"]))

    def difference(name: str, step: float) -> float:
        return (logarithm(name, np.exp(step)) - logarithm(name, np.exp(-step))) / (2 * step)

    # Richardson's extrapolation takes the error of second order away.
    differences = [(4 * difference(n, _STEP) - difference(n, 2 * _STEP)) / 3 for n in PerSpring._fields]
    return Structure(
        axis=axis,
        frequencies=np.asarray(found.frequency),
        damping_ratios=np.asarray(found.damping_ratio),
        deformations={name: value / largest for name, value in size.items()},
        elasticities=lumped_elasticities(axis),
        closed_form=springs * raw**2 / (2 * omega**2),
        differences=np.asarray(differences),
        support_sweep=sweep(
            stiffness,
            {"support": np.linspace(0.5, 1.5, 41)},
            FirstFrequency(axis),
            relative=True,
            units={"first_frequency": "Hz"},
        ),
    )
