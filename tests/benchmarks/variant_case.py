"""Many variants of a short move of the rack-and-pinion drive, as a function that a study maps over them."""

from pathlib import Path
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from tests.benchmarks.rack_case import PATHS, closed_loop, nominal, space, variants
from twin.batch import batched
from twin.batch_result import BatchResult
from twin.control import ClosedLoop
from twin.references import JerkLimitedMove
from twin.simulation import simulate
from twin.stepping import AdaptiveSteps

LENGTH = 0.225
"""Length of the move [m]; it lasts a second at half a metre per second."""
SEED = 17
_ALLOWED = 2.0
"""Greatest preload that is computed, in nominal ones; beyond it the function raises."""
_FIRST_STEPS = 1_500
"""Steps of a first try: ordinary variants need less than 1,000."""


class Variant(eqx.Module):
    """What is asked of one variant: a second's move, and a tenth to settle."""

    loop: ClosedLoop
    reference: JerkLimitedMove
    times: Array
    highest: Array
    """Preload above which a variant is refused [Nm]."""
    stepping: AdaptiveSteps

    def __call__(self, values: Array) -> dict[str, Array]:
        """Final error of the table [m], peak torques [Nm], motor energy [J], largest following error [m]."""
        values = eqx.error_if(values, values[-1] > self.highest, "the preload is beyond what the drive can hold")
        run = simulate(space().unpack(self.loop, values), self.reference, self.times, stepping=self.stepping)
        found, wanted = run.outputs, jax.vmap(self.reference)(self.times).position
        radius = self.loop.plant.travel_per_radian
        power = (found.torque_1 * found.velocity_1 + found.torque_2 * found.velocity_2) / radius
        return {
            "final_error": found.table_position[-1] - LENGTH,
            "peak_torque": jnp.stack([jnp.max(jnp.abs(found.torque_1)), jnp.max(jnp.abs(found.torque_2))]),
            "energy": jnp.trapezoid(power, self.times),
            "following_error": jnp.max(jnp.abs(found.table_position - wanted)),
        }


def variant(max_steps: int = 100_000) -> Variant:
    """The function of a study.

    Args:
        max_steps: steps after which a run is given up and marked.
    """
    stepping = AdaptiveSteps(solver=diffrax.Tsit5(), max_steps=max_steps)
    highest = jnp.asarray(nominal()[-1] * _ALLOWED)
    times = jnp.linspace(0.0, 1.1, 111)
    return Variant(closed_loop(), JerkLimitedMove(LENGTH, 0.5, 1.0, 20.0), times, highest, stepping)


def samples(count: int) -> np.ndarray:
    """Values within 20 % of the nominal ones (samples, parameters)."""
    return variants(count, seed=SEED)


def with_bad_samples(values: np.ndarray) -> tuple[np.ndarray, dict[str, int]]:
    """The same with one sample that is NaN, one with meshes a thousand times as stiff, and one that raises.

    Returns:
        The samples, and the numbers of the three.
    """
    count = len(values)
    values, bad = values.copy(), {"nan": count // 5, "stiff": count // 2, "raises": count - count // 5}
    values[bad["nan"], 0] = np.nan
    values[bad["stiff"], [PATHS.index(f"plant.train_{n}.mesh.stiffness.k1") for n in (1, 2)]] *= 1000.0
    values[bad["raises"], -1] *= 100.0
    return values, bad


def compute(values: np.ndarray, store: Path | None = None, **options: Any) -> BatchResult:
    """The study: a first try of few steps, and a second one with as many as it takes."""
    return batched(variant(_FIRST_STEPS), values, store=store, seed=SEED, retry=variant(), **options)
