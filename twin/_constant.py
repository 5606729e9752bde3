"""Integration by constant steps: continuous plants between saved times, sampled loops between ticks."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from twin._recursion import run_recursion
from twin.control.closed_loop import SampledLoop
from twin.plant import AbstractPlant
from twin.references import AbstractReference
from twin.stepping import ConstantSteps, runge_kutta_steps, stage_times


def solve_constant(
    plant: AbstractPlant,
    reference: AbstractReference,
    state: PyTree[Array],
    times: Float[Array, "times"],
    stepping: ConstantSteps,
) -> tuple[PyTree[Array], Float[Array, ""]]:
    """States at the times, and the error estimate relative to the tolerance."""
    parameters, fixed = eqx.partition(plant, eqx.is_inexact_array)
    begin, length = times[:-1], jnp.diff(times)
    # For all stages of all steps at once: inside the loop the reference would be evaluated one by one.
    inputs = jax.vmap(jax.vmap(jax.vmap(reference)))(
        jax.vmap(lambda *span: stage_times(stepping, *span))(begin, length)
    )

    def step(parameters: PyTree[Array], x: PyTree[Array], item: tuple[Array, Array, Any]) -> tuple[Any, Any]:
        plant = eqx.combine(parameters, fixed)
        start, span, inputs = item
        return runge_kutta_steps(stepping, plant.vector_field, start, span, x, inputs)

    before, last, errors = run_recursion(step, parameters, state, (begin, length, inputs))
    states = jax.tree.map(lambda rows, end: jnp.concatenate([rows, end[None]]), before, last)
    return states, _relative_error(stepping, errors, states)


def run_sampled_loop(
    loop: SampledLoop,
    reference: AbstractReference,
    plant_state: PyTree[Array],
    times: Float[Array, "times"],
    stepping: ConstantSteps,
) -> tuple[PyTree[Array], Any, Float[Array, ""]]:
    """Plant states and outputs at the ticks (outputs with the command that the tick gives), and the error estimate."""
    # Evaluated for all ticks at once: inside the loop the look-up would be done one by one.
    references = jax.vmap(reference)(times)
    injected = None if loop.injection is None else jax.vmap(loop.injection)(times)
    memory = loop.controller.initial_state(loop.measure(times[0], plant_state), loop.period)
    parameters, fixed = eqx.partition(loop, eqx.is_inexact_array)

    def tick(loop: SampledLoop, x: PyTree[Array], item: Any) -> tuple[Any, Any, Any]:
        (state, memory), (t, wanted, added) = x, item
        memory, command = loop.controller.update(memory, wanted, loop.measure(t, state), loop.period)
        return state, memory, loop.inputs(command, added)

    def step(parameters: PyTree[Array], x: PyTree[Array], item: Any) -> tuple[Any, Any]:
        loop = eqx.combine(parameters, fixed)
        state, memory, inputs = tick(loop, x, item)

        def field(time: Array, y: PyTree[Array], _: None) -> PyTree[Array]:
            return loop.plant.vector_field(time, y, inputs)

        after, error = runge_kutta_steps(stepping, field, item[0], loop.period, state)
        return (after, memory), error

    def observe(x: PyTree[Array], item: Any) -> tuple[Any, Any]:
        state, _, inputs = tick(loop, x, item)
        return state, loop.plant.outputs(item[0], state, inputs)

    items = (times, references, injected)
    rows, _, errors = run_recursion(step, parameters, (plant_state, memory), items)
    states, outputs = jax.vmap(observe)(rows, items)
    return states, outputs, _relative_error(stepping, errors, states)


def _relative_error(stepping: ConstantSteps, errors: PyTree[Array], states: PyTree[Array]) -> Float[Array, ""]:
    def largest(error: Array, state: Array) -> Array:
        reached = jax.lax.stop_gradient(jnp.max(jnp.abs(state), axis=0))
        return jnp.max(error / (stepping.atol + stepping.rtol * reached))

    return jnp.max(jnp.stack(jax.tree.leaves(jax.tree.map(largest, errors, states))))
