"""Recursions x[k+1] = f(θ, x[k], u[k]), and two ways to differentiate them.

Alongside: JAX's own rule for a scan, which carries the tangents with the state. It is the fastest where the compiler
turns the loop into one function (see `twin._loop_option`), and in batches.

Afterwards: without that option every operation of a loop is a call of its own, which costs more than the arithmetic of
a feed drive. The states are then found first, and all steps are linearised together.
"""

import contextlib
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from typing import Any

import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float, PyTree

from twin._loop_option import small_loops_are_one_function

_in_batch: ContextVar[bool] = ContextVar("in_batch", default=False)

# Steps linearised together: enough to fill vector units, few enough that intermediate results stay in cache.
_CHUNK = 256


def run_recursion(
    step: Callable[[PyTree[Array], PyTree[Array], PyTree[Array]], tuple[PyTree[Array], PyTree[Array]]],
    parameters: PyTree[Array],
    start: PyTree[Array],
    items: PyTree[Array],
) -> tuple[PyTree[Array], PyTree[Array], PyTree[Array]]:
    """All states of a recursion; forward and reverse mode both work.

    Args:
        step: function of (parameters, state, item) that returns the next state, and something that is not
            differentiated (an error estimate).
        parameters: arrays θ that every step sees.
        start: first state x[0].
        items: arrays u with a leading axis over the steps.

    Returns:
        The states before each step, the state after the last one, and what else the steps returned, stacked.
    """
    if _in_batch.get() or (small_loops_are_one_function() and jax.default_backend() == "cpu"):
        # A state stays in its parts: in a batch every part is then one run of numbers, as vector units want it.
        return _plain(step, parameters, start, items)
    flat_start, unravel = ravel_pytree(start)

    def flat_step(parameters: PyTree[Array], x: Array, item: PyTree[Array]) -> tuple[Array, PyTree[Array]]:
        after, extra = step(parameters, unravel(x), item)
        return ravel_pytree(after)[0], extra

    states, last, extras = _run_afterwards(flat_step, parameters, flat_start, items)
    return jax.vmap(unravel)(states), unravel(last), extras


def _plain(step: Callable, parameters: PyTree[Array], start: PyTree[Array], items: PyTree[Array]) -> tuple:
    start = jax.tree.map(jnp.asarray, start)

    def body(x: PyTree[Array], item: PyTree[Array]) -> tuple[PyTree[Array], tuple[PyTree[Array], PyTree[Array]]]:
        after, extra = step(parameters, x, item)
        after = jax.tree.map(lambda new, old: jnp.asarray(new, old.dtype), after, x)
        return after, (x, jax.lax.stop_gradient(extra))

    last, (states, extras) = jax.lax.scan(body, start, items)
    return states, last, extras


def _run_afterwards(
    step: Callable[[PyTree[Array], Float[Array, " n"], PyTree[Array]], tuple[Float[Array, " n"], PyTree[Array]]],
    parameters: PyTree[Array],
    start: Float[Array, " n"],
    items: PyTree[Array],
) -> tuple[Float[Array, "steps n"], Float[Array, " n"], PyTree[Array]]:
    run = jax.custom_jvp(lambda parameters, start, items: _plain(step, parameters, start, items))

    # All steps at once: x'[k+1] = A[k]·x'[k] + b[k] leaves only tiny matrix products to the recursion.
    @run.defjvp
    def run_jvp(primals: Any, tangents: Any) -> Any:
        parameters, start, items = primals
        d_parameters, d_start, d_items = tangents
        states, last, extras = run(parameters, start, items)

        def linearised(at: Any) -> tuple[Array, Array]:
            x, item, d_item = at
            _, along = jax.linearize(lambda p, y, i: step(p, y, i)[0], parameters, x, item)
            still = jax.tree.map(jnp.zeros_like, (parameters, item))
            propagation = jax.vmap(lambda dx: along(still[0], dx, still[1]), out_axes=1)(jnp.eye(x.size))
            return propagation, along(d_parameters, jnp.zeros_like(x), d_item)

        a, b = _map_in_chunks(linearised, (states, items, d_items))

        def body(dx: Array, at: tuple[Array, Array]) -> tuple[Array, Array]:
            # Written as a sum: a dot call costs more than these few products.
            return jnp.sum(at[0] * dx, axis=-1) + at[1], dx

        d_last, d_states = jax.lax.scan(body, d_start, (a, b))
        return (states, last, extras), (d_states, d_last, jax.tree.map(jnp.zeros_like, extras))

    return run(parameters, start, items)


@contextlib.contextmanager
def tangents_alongside() -> Iterator[None]:
    """While a function is traced that will run as a batch: recursions are differentiated alongside."""
    token = _in_batch.set(True)
    try:
        yield
    finally:
        _in_batch.reset(token)


def _map_in_chunks(function: Callable, items: PyTree[Array]) -> PyTree[Array]:
    """`jax.lax.map` with the last chunk filled up by repetition, so that there is one chunk shape to compile."""
    count = jax.tree.leaves(items)[0].shape[0]
    chunk = min(_CHUNK, count)
    filled = -(-count // chunk) * chunk
    index = jnp.minimum(jnp.arange(filled), count - 1).reshape(-1, chunk)
    out = jax.lax.map(lambda rows: jax.vmap(function)(jax.tree.map(lambda x: x[rows], items)), index)
    return jax.tree.map(lambda x: x.reshape((filled, *x.shape[2:]))[:count], out)
