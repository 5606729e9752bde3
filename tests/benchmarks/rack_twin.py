"""The twin on the rack-and-pinion case."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from tests.benchmarks.rack_case import PARAMETERS, TIMES, closed_loop, move, space
from twin.simulation import simulate
from twin.stepping import AbstractStepping


def twin_run(stepping: AbstractStepping) -> Callable[[np.ndarray], np.ndarray]:
    """One simulation, shape (times, 3).

    Args:
        stepping: how time is stepped.
    """
    # Passed as arguments: what is closed over is a constant to the compiler.
    fixed = _fixed(stepping)
    return lambda values: np.asarray(_run(jnp.asarray(values), *fixed))


def twin_batch(stepping: AbstractStepping, width: int, threads: int = 1) -> Callable[[np.ndarray], np.ndarray]:
    """Many simulations, shape (variants, times, 3).

    Args:
        stepping: how time is stepped.
        width: variants that run in step, as one program.
        threads: programs that run side by side.
    """
    fixed = _fixed(stepping)

    def part(rows: np.ndarray) -> np.ndarray:
        return np.asarray(_batch(jnp.asarray(rows), *fixed))

    def run(values: np.ndarray) -> np.ndarray:
        parts = [values[i : i + width] for i in range(0, len(values), width)]
        if threads == 1:
            return np.concatenate([part(rows) for rows in parts])
        with ThreadPoolExecutor(threads) as pool:
            return np.concatenate(list(pool.map(part, parts)))

    return run


def twin_jacobian(stepping: AbstractStepping) -> Callable[[np.ndarray], np.ndarray]:
    """Derivative of the torques along relative changes of the parameters, shape (times, 2, parameters) [Nm].

    Args:
        stepping: how time is stepped.
    """
    fixed = _fixed(stepping)
    return lambda values: np.asarray(_jacobian(jnp.ones(PARAMETERS), jnp.asarray(values), *fixed))


class Work(NamedTuple):
    """Work of one evaluation of the vector field for one of the variants, as the compiler counts it."""

    flops: float
    """Floating-point operations [-]; a root, an exponential or a quotient counts as one."""
    read_and_written: float
    """Memory that its fused loops read and write [byte]."""


def work_per_evaluation(width: int) -> Work:
    """The `cost_analysis` of the compiled vector field, the constants of the laws included.

    Args:
        width: variants that run in step.
    """
    loop, reference = closed_loop(), move()
    now = jnp.asarray(1.0)

    def rates(row: Array, state: Any) -> Any:
        return space().unpack(loop, row).vector_field(now, state, reference(now))

    rows = jnp.tile(space().pack(loop), (width, 1))
    states = jax.tree.map(lambda x: jnp.tile(x, width), loop.initial_state())
    cost: Any = jax.jit(jax.vmap(rates)).lower(rows, states).compile().cost_analysis()
    return Work(cost["flops"] / width, cost["bytes accessed"] / width)


def _fixed(stepping: AbstractStepping) -> tuple:
    return closed_loop(), move(), jnp.asarray(TIMES), stepping


def _simulate(values: Array, loop: Any, reference: Any, times: Array, stepping: Any) -> Array:
    outputs = simulate(space().unpack(loop, values), reference, times, stepping=stepping).outputs
    return jnp.stack([outputs.table_position, outputs.torque_1, outputs.torque_2], axis=-1)


_run = eqx.filter_jit(_simulate)


@eqx.filter_jit
def _batch(values: Array, *fixed: Any) -> Array:
    return jax.vmap(lambda row: _simulate(row, *fixed))(values)


@eqx.filter_jit
def _jacobian(relative: Array, values: Array, *fixed: Any) -> Array:
    def torques(relative: Array) -> Array:
        return _simulate(values * jnp.append(relative, 1.0), *fixed)[:, 1:]

    return jax.jacfwd(torques)(relative)
