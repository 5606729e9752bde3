"""Modal data of a machine: what is measured where, and what is searched in which bounds."""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from fitting.residuals.modes import ModesResidual
from twin._checks import InputError
from twin.modal import ReferenceModes, modes, reference_modes
from twin.parameters import Parameter, ParameterSpace
from twin.paths import get_leaf
from twin.structure import Machine
from twin.structure.reference_machine import MODES
from twin.structure.reference_quantities import UNKNOWN, Quantity

STIFFNESS_BOUNDS = (0.7, 1.3)
"""Bounds of a stiffness, as shares of its nominal value; eq. 14."""
DAMPING_BOUNDS = (1 / 3, 3.0)
"""Bounds of a damping, as shares of its nominal value; eq. 14."""


def unknown_space(machine: Machine, unknown: Sequence[Quantity] = UNKNOWN) -> ParameterSpace:
    """The searched parameters within the bounds of eq. 14, on a logarithmic scale.

    Args:
        machine: machine with the nominal values.
        unknown: quantities of kind stiffness, viscous or hysteretic.
    """

    def parameter(quantity: Quantity) -> Parameter:
        nominal = float(get_leaf(machine, quantity.path))
        lower, upper = STIFFNESS_BOUNDS if quantity.kind == "stiffness" else DAMPING_BOUNDS
        return Parameter(quantity.path, quantity.unit, lower * nominal, upper * nominal, scale="log")

    return ParameterSpace([parameter(quantity) for quantity in unknown])


def stiffness_space(space: ParameterSpace) -> ParameterSpace:
    """The stiffnesses of a space, by their paths.

    Args:
        space: of a machine's joints.
    """
    return space.subset([path for path in space.paths if ".stiffness." in path])


def nuisance_space(quantities: Sequence[Quantity]) -> ParameterSpace:
    """Quantities that are not searched but not exactly known either: free without bounds, as a prior holds them.

    Args:
        quantities: which.
    """
    return ParameterSpace([Parameter(quantity.path, quantity.unit) for quantity in quantities])


def translations(machine: Machine) -> tuple[str, ...]:
    """Names of the translations of all nodes, as accelerometers measure them.

    Args:
        machine: the machine.
    """
    return tuple(name for name in machine.outputs if name.rpartition(" ")[2] in ("x", "y", "z"))


def measured_modes(
    machine: Machine, positions: Sequence[float], *, count: int = MODES, outputs: tuple[str, ...] | None = None
) -> tuple[ReferenceModes, ...]:
    """What modal analysis of a machine would give without noise: its first modes at each axis position.

    Args:
        machine: the machine.
        positions: axis positions [m].
        count: number of modes.
        outputs: names of the outputs; all translations if not given.

    Raises:
        InputError: a position off a rail, fewer modes than asked for, an unknown output.
    """
    names = translations(machine) if outputs is None else tuple(outputs)
    return tuple(
        reference_modes(_modes(machine, jnp.asarray(float(position)), names), indices=tuple(range(count)))
        for position in _checked(machine, positions)
    )


def noisy(
    references: Sequence[ReferenceModes],
    seed: int,
    *,
    frequency: float = 1e-3,
    shape: float = 1e-2,
    damping: float = 5e-2,
) -> tuple[ReferenceModes, ...]:
    """Modes as a measurement with noise gives them; the noise of `ModesResidual`'s weights.

    Args:
        references: modes without noise.
        seed: of the random numbers.
        frequency: relative standard deviation of the frequencies [-].
        shape: standard deviation of the shapes' entries, as a share of the shape's rms [-].
        damping: relative standard deviation of the damping ratios [-].
    """
    random = np.random.default_rng(seed)

    def one(reference: ReferenceModes) -> ReferenceModes:
        shapes = np.asarray(reference.output_shapes)
        rms = np.sqrt(np.mean(shapes**2, axis=0))
        return ReferenceModes(
            np.asarray(reference.frequency) * np.exp(frequency * random.standard_normal(rms.size)),
            np.asarray(reference.damping_ratio) * np.exp(damping * random.standard_normal(rms.size)),
            shapes + shape * rms * random.standard_normal(shapes.shape),
            reference.outputs,
        )

    return tuple(one(reference) for reference in references)


def evidence(machine: Machine, references: Sequence[ReferenceModes], positions: Sequence[float]) -> ModesResidual:
    """The modes of a machine as evidence, after a look at whether the machine can have them.

    Args:
        machine: the model to be identified.
        references: measured modes at each position.
        positions: axis positions [m].

    Raises:
        InputError: a position off a rail, an output that the machine does not have, whatever `ModesResidual` refuses.
    """
    residual = ModesResidual.of(references, list(_checked(machine, positions)))
    for name in residual.outputs:
        if name not in machine.outputs:
            raise InputError(
                f"The reference has an output {name!r} that the machine does not have. Name the rows as the machine's "
                "nodes and directions, for instance 'N6 x'."
            )
    return residual


def _checked(machine: Machine, positions: Sequence[float]) -> tuple[float, ...]:
    for position in positions:
        machine.connections(float(position))  # raises off a rail, which a traced position could not
    return tuple(float(position) for position in positions)


@eqx.filter_jit
def _modes(machine: Machine, position: jnp.ndarray, outputs: tuple[str, ...]):
    return modes(machine.second_order(position, inputs=(), outputs=outputs))
