"""Integration by constant steps: continuous plants between saved times, sampled loops between ticks."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from twin._recursion import flattener, run_recursion
from twin.control.closed_loop import SampledLoop
from twin.plant import AbstractPlant
from twin.references import AbstractReference
from twin.stepping import ConstantSteps, runge_kutta_steps


def solve_constant(
    plant: AbstractPlant,
    reference: AbstractReference,
    state: PyTree[Array],
    times: Float[Array, "times"],
    stepping: ConstantSteps,
) -> tuple[PyTree[Array], Float[Array, ""]]:
    """States at the times, and the error estimate relative to the tolerance."""
    parameters, fixed = eqx.partition((plant, reference), eqx.is_inexact_array)
    ravel, unravel = flattener(state)

    def step(parameters: PyTree[Array], x: Array, span: tuple[Array, Array]) -> tuple[Array, Array]:
        plant, reference = eqx.combine(parameters, fixed)
        begin, end = span

        def field(t: Array, y: PyTree[Array]) -> PyTree[Array]:
            return plant.vector_field(t, y, reference(t))

        after, error = runge_kutta_steps(stepping, field, begin, end - begin, unravel(x))
        return ravel(after), ravel(error)

    before, last, errors = run_recursion(step, parameters, ravel(state), (times[:-1], times[1:]))
    vectors = jnp.concatenate([before, last[None]])
    return jax.vmap(unravel)(vectors), _relative_error(stepping, errors, vectors)


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
    ravel, unravel = flattener((plant_state, memory))
    ravel_state, _ = flattener(plant_state)

    def tick(loop: SampledLoop, x: Array, item: Any) -> tuple[Any, Any, Any]:
        (state, memory), (t, wanted, added) = unravel(x), item
        memory, command = loop.controller.update(memory, wanted, loop.measure(t, state), loop.period)
        return state, memory, loop.inputs(command, added)

    def step(parameters: PyTree[Array], x: Array, item: Any) -> tuple[Array, Array]:
        loop = eqx.combine(parameters, fixed)
        state, memory, inputs = tick(loop, x, item)

        def field(time: Array, y: PyTree[Array]) -> PyTree[Array]:
            return loop.plant.vector_field(time, y, inputs)

        after, error = runge_kutta_steps(stepping, field, item[0], loop.period, state)
        return ravel((after, memory)), ravel_state(error)

    def observe(x: Array, item: Any) -> tuple[Any, Any]:
        state, _, inputs = tick(loop, x, item)
        return state, loop.plant.outputs(item[0], state, inputs)

    items = (times, references, injected)
    vectors, _, errors = run_recursion(step, parameters, ravel((plant_state, memory)), items)
    states, outputs = jax.vmap(observe)(vectors, items)
    return states, outputs, _relative_error(stepping, errors, jax.vmap(ravel_state)(states))


def _relative_error(stepping: ConstantSteps, errors: Float[Array, "steps n"], states: Array) -> Float[Array, ""]:
    largest = jax.lax.stop_gradient(jnp.max(jnp.abs(states), axis=0))
    return jnp.max(errors / (stepping.atol + stepping.rtol * largest))
