"""The unknown springs and dampers of a machine, and the intervals that they are searched in."""

from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from twin._checks import InputError
from twin.parameters import Parameter, ParameterSpace
from twin.paths import get_leaf
from twin.structure import Machine
from twin.structure.reference_quantities import UNKNOWN, Quantity

STIFFNESS, VISCOUS, HYSTERETIC = "stiffness", "viscous", "hysteretic"
STIFFNESS_INTERVAL, DAMPING_INTERVAL = (0.7, 1.3), (1 / 3, 3.0)
"""Intervals of eq. 14, as shares of a nominal value."""


class Unknowns(NamedTuple):
    """What the parameters of a space are in a machine of springs and dampers."""

    kind: np.ndarray
    """"stiffness", "viscous" or "hysteretic" of each parameter (parameters,)."""
    joint: tuple[str, ...]
    """Name of the joint of each."""
    direction: tuple[str, ...]
    """Direction of each."""

    @property
    def stiffness(self) -> np.ndarray:
        """Numbers of the stiffnesses in the space."""
        return np.flatnonzero(self.kind == STIFFNESS)

    @property
    def damping(self) -> np.ndarray:
        """Numbers of the dampings in the space."""
        return np.flatnonzero(self.kind != STIFFNESS)


def unknown_space(machine: Machine, *, scale: str = "linear") -> ParameterSpace:
    """The 27 unknowns of the reference machine, within the intervals of eq. 14 around a machine's values.

    Args:
        machine: machine with the reference machine's joints; its values are the middle, not the bounds' mean for
            dampings.
        scale: "linear" for problems whose starts are uniform in the values, "log" for joint fits.

    Returns:
        The space: stiffnesses between 0.7 and 1.3 times the value, dampings between a third and three times.
    """
    parameters = []
    for quantity in UNKNOWN:
        low, high = STIFFNESS_INTERVAL if quantity.kind == STIFFNESS else DAMPING_INTERVAL
        value = float(get_leaf(machine, quantity.path))
        parameters.append(Parameter(quantity.path, quantity.unit, low * value, high * value, scale=scale))
    return ParameterSpace(parameters)


def stiffness_space(space: ParameterSpace) -> ParameterSpace:
    """The stiffnesses of a space, by their paths.

    Args:
        space: of a machine's joints.

    Raises:
        InputError: a space without one.
    """
    paths = [path for path in space.paths if ".stiffness." in path]
    if not paths:
        raise InputError("The space has no stiffness of a joint for the balance of forces. Add one, or give a start.")
    return space.subset(paths)


def nuisance_space(quantities: Sequence[Quantity]) -> ParameterSpace:
    """Quantities that are not searched but not exactly known either: free without bounds, as a prior holds them.

    Args:
        quantities: which.
    """
    return ParameterSpace([Parameter(quantity.path, quantity.unit) for quantity in quantities])


def unknowns(space: ParameterSpace) -> Unknowns:
    """What each parameter of a space is.

    Args:
        space: stiffnesses and dampings of joints.

    Raises:
        InputError: a parameter that is none, is tied to another, or has no finite bounds.
    """
    kinds, joints, directions = [], [], []
    for parameter in space.parameters:
        parts = parameter.path.split(".")
        if len(parts) != 4 or parts[0] != "joints" or parts[2] not in (STIFFNESS, VISCOUS, HYSTERETIC):
            raise InputError(
                f"{parameter.path!r} is no stiffness or damping of a joint. Search "
                "joints.<name>.stiffness.<direction>, and viscous or hysteretic in its place; others are no linear "
                "part of the machine's matrices."
            )
        if parameter.tied:
            raise InputError(f"{parameter.path!r} is tied to {parameter.tied[0]!r}. Give each place the same joint.")
        if not np.isfinite([parameter.lower, parameter.upper]).all() or parameter.lower < 0:
            raise InputError(
                f"{parameter.path!r} needs finite bounds that are not negative, but has {parameter.lower:g} to "
                f"{parameter.upper:g} {parameter.unit}. See unknown_space for those of eq. 14."
            )
        joints.append(parts[1])
        kinds.append(parts[2])
        directions.append(parts[3])
    return Unknowns(np.asarray(kinds), tuple(joints), tuple(directions))


def without_unknowns(machine: Machine, space: ParameterSpace) -> Machine:
    """The machine with all parameters of a space at zero: what is known of it.

    Args:
        machine: machine.
        space: unknown parameters.
    """
    return space.with_values(machine, jnp.zeros(len(space)))
