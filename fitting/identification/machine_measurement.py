"""What modal analysis measures of a machine: outputs, modes with and without noise, and their weight as evidence."""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from fitting.identification.machine_evidence import require_distinct
from fitting.residuals.modes import ModesResidual
from twin._checks import InputError
from twin.modal import ReferenceModes, modes, reference_modes
from twin.structure import Machine
from twin.structure.reference_machine import MODES


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


def modal_evidence(machine: Machine, references: Sequence[ReferenceModes], positions: Sequence[float]) -> ModesResidual:
    """The modes of a machine as evidence, after a look at whether the machine can have them.

    Args:
        machine: the model to be identified.
        references: measured modes at each position.
        positions: axis positions [m].

    Raises:
        InputError: a position off a rail, an output that the machine does not have, whatever `ModesResidual` refuses.
    """
    residual = ModesResidual.of(references, list(_checked(machine, positions)))
    known = machine.outputs
    for name in residual.outputs:
        if name not in known:
            raise InputError(
                f"The reference has an output {name!r} that the machine does not have. Name the rows as the machine's "
                "nodes and directions, for instance 'N6 x'."
            )
    return residual


def _checked(machine: Machine, positions: Sequence[float]) -> tuple[float, ...]:
    require_distinct(positions)
    for position in positions:
        machine.connections(float(position))  # raises off a rail, which a traced position could not
    return tuple(float(position) for position in positions)


@eqx.filter_jit
def _modes(machine: Machine, position: jnp.ndarray, outputs: tuple[str, ...]):
    return modes(machine.second_order(position, inputs=(), outputs=outputs))
