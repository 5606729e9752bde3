"""Price of one odd sample in a batch of a drive's moves: one that is NaN, one much stiffer, one that raises."""

import time

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array

from tests.benchmarks.drive_case import drive_case
from tests.benchmarks.summary import SummaryRow, ratio_row, refused_row
from twin.batch import batched
from twin.control import ClosedLoop
from twin.paths import set_leaves
from twin.references import JerkLimitedMove
from twin.simulation import simulate
from twin.stepping import AdaptiveSteps

GOAL = 1.5
"""Largest ratio of times."""
SAME = 1e-5
"""Largest difference of the other samples' results, relative to the largest: their steps are chosen by tolerance."""
STIFFER = 1000.0


class Move(eqx.Module):
    """Highest deflection of a two-mass drive's shaft through a move, at a stiffness; a negative one raises."""

    drive: ClosedLoop
    stepping: AdaptiveSteps

    def __call__(self, stiffness: Array) -> Array:
        stiffness = eqx.error_if(stiffness, stiffness < 0, "the stiffness is negative")
        drive = set_leaves(self.drive, {"plant.stiffness": stiffness})
        reference = JerkLimitedMove(1.0, 12.0, 300.0, 2e4, start_time=0.01)
        found = simulate(drive, reference, jnp.linspace(0.0, 0.3, 31), stepping=self.stepping).outputs
        return found.position - found.load_position


def odd_samples(count: int = 4096, rounds: int = 3) -> list[SummaryRow]:
    """One row for each kind of odd sample.

    Args:
        count: samples in the batch.
        rounds: turns of timing.
    """
    # Three times the usual number of steps is not waited for here, but in the second try.
    drive = drive_case(10).model
    first, second = (Move(drive, AdaptiveSteps(max_steps=steps)) for steps in (600, 100_000))
    samples = np.random.default_rng(1).uniform(200.0, 800.0, count)
    place = count // 2
    others = np.arange(count) != place
    kinds = {"NaN": np.nan, f"{STIFFER:g} times stiffer": STIFFER * samples[place], "raising": -1.0}
    batches = {"": samples} | {name: np.where(others, samples, value) for name, value in kinds.items()}

    found = {name: batched(first, rows, retry=second, progress=False).value for name, rows in batches.items()}
    times: dict[str, list[float]] = {name: [] for name in batches}
    for _ in range(rounds):
        for name, rows in batches.items():
            clock = time.perf_counter()
            batched(first, rows, retry=second, progress=False)
            times[name].append(time.perf_counter() - clock)
    result = []
    for name in kinds:
        error = np.max(np.abs(found[name] - found[""])[others]) / np.max(np.abs(found[""]))
        what, peer = f"one sample {name} among {count}", "batch without it: a price"
        if error <= SAME:
            told = f"others unchanged to {error:.0e}"
            result.append(ratio_row(what, peer, times[name], times[""], told, most=GOAL))
        else:
            result.append(refused_row(what, peer, f"others changed by {error:.0e}, limit {SAME:.0e}", most=GOAL))
    return result
