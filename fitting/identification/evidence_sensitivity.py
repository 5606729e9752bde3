"""How much the modes of a machine, as evidence, depend on quantities that are not searched."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.identification.machine_measurement import measured_modes, modal_evidence
from fitting.identification.machine_unknowns import nuisance_space
from fitting.residuals.modes import ModesResidual
from twin.parameters import ParameterSpace
from twin.structure import Machine
from twin.structure.reference_machine import MODES
from twin.structure.reference_quantities import Quantity


def evidence_sensitivity(
    machine: Machine, quantities: Sequence[Quantity], positions: Sequence[float], *, count: int = MODES
) -> Float[np.ndarray, "quantities"]:
    """Change of a machine's modes per relative change of each quantity, in standard deviations of a measurement.

    The rms over all entries of frequencies, shapes and damping ratios, which weigh as in `ModesResidual.of`: 1 means
    that a quantity wrong by 1 % moves an entry by 0.01 standard deviations.

    Args:
        machine: the machine, whose own modes are the reference.
        quantities: which.
        positions: axis positions [m].
        count: number of modes at each position.

    Returns:
        Sensitivity of each quantity [-].

    Raises:
        InputError: a quantity that the machine does not have, a position off a rail, fewer modes than asked for.
    """
    data = modal_evidence(machine, measured_modes(machine, positions, count=count), positions)
    slopes = np.asarray(_slopes(data, machine, nuisance_space(quantities)))
    return np.sqrt(np.mean(slopes**2, axis=0))


@eqx.filter_jit
def _slopes(data: ModesResidual, machine: Machine, space: ParameterSpace) -> Array:
    values = space.values(machine)

    def changed(share: Array) -> Array:
        return data(space.with_values(machine, values * (1 + share)))

    return jax.jacfwd(changed)(jnp.zeros(len(space)))
