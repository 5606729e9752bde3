"""The twin as an entrant."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from tests.benchmarks.emps_case import Case
from tests.benchmarks.entrant import Entrant
from twin.references import SampledReference
from twin.simulation import simulate
from twin.stepping import ConstantSteps


def twin_entrant(case: Case, substeps: int, role: str) -> Entrant:
    """The twin with a number of steps per tick; the Jacobian is `jax.jacfwd` over the scaled vector."""
    vector, times = jnp.asarray(case.vector), jnp.asarray(case.times)
    reference = SampledReference(times, case.wanted)
    stepping = ConstantSteps(substeps=substeps)

    def positions(vector, loop, reference, times):
        return simulate(case.space.unpack(loop, vector), reference, times, stepping=stepping).outputs.position

    run = eqx.filter_jit(positions)
    differentiate = eqx.filter_jit(jax.jacfwd(positions))
    # Passed as arguments: what is closed over is a constant to the compiler, which no fit would grant it.
    arguments = (vector, case.loop, reference, times)
    return Entrant(
        f"twin, {substeps} step{'s' if substeps > 1 else ''} per tick",
        role,
        simulate=lambda: np.asarray(run(*arguments)),
        jacobian=lambda: np.asarray(differentiate(*arguments)),
        compiles=True,
    )
