"""Functions for batches, in a module of their own so that workers can read them."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from reference_systems import SineCommand, viscous_axis

from twin.drives import ServoAxis
from twin.paths import set_leaves
from twin.simulation import simulate
from twin.stepping import AbstractStepping, AdaptiveSteps, ConstantSteps

SCALE = 2.0


def quadratic(x: Float[Array, "3"]) -> dict[str, Array]:
    """Two outputs, of which one is a vector."""
    return {"sum": SCALE * jnp.sum(x**2), "double": x * 2}


def refuses_high(x: Float[Array, "3"]) -> Array:
    """Raises where the first entry is high."""
    x = eqx.error_if(x, x[0] > 0.999, "too high")
    return jnp.sum(jnp.log(x))


def counted(x: Float[Array, "3"]) -> Array:
    """A loop whose length depends on the sample."""
    steps = jnp.round(1000 * x[0])
    return jax.lax.while_loop(lambda c: c[0] < steps, lambda c: (c[0] + 1, c[1] * 0.999 + x[1]), (0.0, x[2]))[1]


def slow_square(x: np.ndarray) -> dict[str, Any]:
    """Square of a number, after a pause."""
    time.sleep(0.02)
    return {"square": x**2, "sine": np.sin(x)}


def dies_once(x: np.ndarray) -> float:
    """Kills its process where a number is high, unless it did before."""
    before = Path(os.environ["DIED_BEFORE"])
    if x > 0.5 and not before.exists():
        before.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return float(x)


class AwkwardError(Exception):
    """Can be sent, but not read."""

    def __init__(self, first: str, second: str) -> None:
        super().__init__(first + second)


def awkward(rows: np.ndarray) -> np.ndarray:
    """Fails for a whole chunk."""
    raise AwkwardError("wrong ", "units")


class Line(eqx.Module):
    """A module whose arrays are not part of the program."""

    slope: Array

    def __call__(self, x: Float[Array, "3"]) -> Array:
        return self.slope * x[0]


class Move(eqx.Module):
    """Position and highest speed of an axis that is pushed for a second."""

    axis: ServoAxis
    stepping: AbstractStepping

    def __call__(self, sample: dict[str, Array]) -> dict[str, Array]:
        axis = set_leaves(self.axis, {"mass": sample["mass"], "friction.viscous": sample["viscous"]})
        found = simulate(axis, SineCommand(20.0, 3.0), jnp.linspace(0.0, 1.0, 21), stepping=self.stepping)
        return {"position": found.outputs.position[-1], "highest": jnp.max(jnp.abs(found.outputs.velocity))}


def move(adaptive: bool) -> Move:
    """The move with steps of one kind."""
    return Move(viscous_axis(), AdaptiveSteps(rtol=1e-6, atol=1e-9) if adaptive else ConstantSteps(substeps=8))


@contextlib.contextmanager
def started(script: Path, *arguments: object, **environment: str) -> Iterator[subprocess.Popen]:
    """A Python script in a process of its own that can import what the tests can; it is killed in the end."""
    here = Path(__file__).parent
    path = os.pathsep.join([str(here), str(here.parents[1]), str(here.parents[2])])
    process = subprocess.Popen(
        [sys.executable, str(script), *map(str, arguments)],
        env={**os.environ, "PYTHONPATH": path, **environment},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    with process:
        try:
            yield process
        finally:
            process.kill()


def wait_until(ready: Callable[[], bool]) -> None:
    """Wait for what another process does; a test that waits for ever must end."""
    for _ in range(12_000):
        if ready():
            return
        time.sleep(0.01)
    raise TimeoutError
