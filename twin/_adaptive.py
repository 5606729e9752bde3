"""Error-controlled integration by diffrax, with forward sensitivities integrated together with the state."""

import functools
from collections.abc import Callable
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Float, Int, PyTree

from twin.plant import AbstractPlant
from twin.references import AbstractReference
from twin.stepping import AdaptiveSteps

# How an integration ended. Only a state that is no longer finite drives the step to its smallest length.
COMPLETE, OUT_OF_STEPS, DIVERGED = 0, 1, 2


def solve_adaptive(
    plant: AbstractPlant,
    reference: AbstractReference,
    state: PyTree[Array],
    times: Float[Array, "times"],
    stepping: AdaptiveSteps,
) -> tuple[PyTree[Array], Int[Array, ""]]:
    """States at the times, and how the integration ended: COMPLETE, OUT_OF_STEPS or DIVERGED."""
    if stepping.gradient == "reverse":
        return _integrate(_field(plant, reference), state, times, reference, stepping)

    # The derivative rule sees one flat list of arrays; everything else is closed over.
    varied, fixed = eqx.partition((plant, reference, state), eqx.is_inexact_array)
    varied, structure = jax.tree.flatten(varied)
    settings, options = eqx.partition((times, stepping), eqx.is_array)

    def rebuild(arrays: list) -> tuple[AbstractPlant, AbstractReference, PyTree]:
        # JAX hands constants to the rules below as NumPy literals.
        return eqx.combine(jax.tree.unflatten(structure, [jnp.asarray(a) for a in arrays]), fixed)

    @jax.custom_jvp
    def solve(arrays: PyTree, settings: PyTree) -> tuple[PyTree, Int[Array, ""]]:
        plant, reference, state = rebuild(arrays)
        times, stepping = eqx.combine(settings, options)
        return _integrate(_field(plant, reference), state, times, reference, stepping)

    def with_directions(
        arrays: list, directions: dict, axes: dict, settings: PyTree
    ) -> tuple[PyTree, Int[Array, ""], PyTree]:
        """State and its derivative along several directions at once.

        Directions have entries for those arrays that change, by their number; `axes` says which differ between them.
        """
        _, reference, state = rebuild(arrays)
        moving = {number: jnp.asarray(arrays[number]) for number in directions}
        times, stepping = eqx.combine(settings, options)
        # A direction stands for about 100 % of its parameters, so that state and sensitivity share one tolerance.
        size = jax.vmap(lambda d: _relative_size(moving, d), in_axes=(axes,))(directions)

        def moved(moving: dict) -> tuple[AbstractPlant, AbstractReference, PyTree]:
            return rebuild([moving.get(number, array) for number, array in enumerate(arrays)])

        def flow(moving: dict, t: Array, y: PyTree) -> PyTree:
            plant, reference, _ = moved(moving)
            return plant.vector_field(t, y, reference(t))

        def scaled(direction: dict, scale: Array) -> dict:
            return jax.tree.map(lambda d: d / scale, direction)

        along = jax.vmap(scaled, in_axes=(axes, 0))(directions, size)

        def augmented(t: Array, y: Any) -> Any:
            value, sensitivity = y
            rate, derivative = jax.linearize(lambda a, v: flow(a, t, v), moving, value)
            return rate, jax.vmap(derivative)(along, sensitivity)

        def at_start(direction: dict) -> PyTree:
            return jax.jvp(lambda a: moved(a)[2], (moving,), (direction,))[1]

        sensitivity = jax.vmap(at_start)(along)
        (states, sensitivities), ending = _integrate(augmented, (state, sensitivity), times, reference, stepping)
        # Saved times lead; directions go first, as vmap wants them.
        unscaled = jax.tree.map(lambda s: jnp.moveaxis(s, 1, 0) * _fit(size, s.ndim), sensitivities)
        return states, ending, unscaled

    @jax.custom_batching.custom_vmap
    def along_one(arrays: list, direction: dict, settings: PyTree) -> tuple[PyTree, Int[Array, ""], PyTree]:
        directions = jax.tree.map(lambda d: d[None], direction)
        states, ending, tangents = with_directions(arrays, directions, jax.tree.map(lambda _: 0, directions), settings)
        return states, ending, jax.tree.map(lambda s: s[0], tangents)

    @along_one.def_vmap
    def along_many(size: int, batched: Any, arrays: Any, direction: Any, settings: Any) -> Any:
        # A Jacobian (only the directions differ) integrates the state once with all its sensitivities. A batch of
        # models is an ordinary batch.
        in_axes = jax.tree.map(lambda b: 0 if b else None, batched)
        if any(jax.tree.leaves((batched[0], batched[2]))):
            out = jax.vmap(along_one.fun, in_axes=in_axes, axis_size=size)(arrays, direction, settings)
            return out, jax.tree.map(lambda _: True, out)
        states, ending, tangents = with_directions(arrays, direction, in_axes[1], settings)
        out = (states, ending, tangents)
        flags = (jax.tree.map(lambda _: False, states), False, jax.tree.map(lambda _: True, tangents))
        return out, flags

    # Arrays that do not change take no part in the sensitivities: most parameters of a model are fixed.
    @functools.partial(solve.defjvp, symbolic_zeros=True)
    def solve_jvp(primals: Any, tangents: Any) -> Any:
        arrays, settings = primals
        changes = enumerate(tangents[0])
        direction = {number: d for number, d in changes if not isinstance(d, jax.custom_derivatives.SymbolicZero)}
        states, ending, derivative = along_one(arrays, direction, settings)
        return (states, ending), (derivative, _no_tangent(ending))

    return solve(varied, settings)


def _field(plant: AbstractPlant, reference: AbstractReference) -> Callable:
    return lambda t, y: plant.vector_field(t, y, reference(t))


def _integrate(
    field: Callable, state: PyTree[Array], times: Array, reference: AbstractReference, stepping: AdaptiveSteps
) -> tuple[PyTree[Array], Int[Array, ""]]:
    # What a reference returns is continuous, so a moving switching time adds nothing of its own to a derivative.
    knots = jax.lax.stop_gradient(reference.switching_times())
    # The integrator sees the leaves alone: empty tuples in a state (a law without memory) trip its buffers.
    leaves, structure = jax.tree.flatten(state)

    def rates(t: Any, y: Any, args: Any) -> Any:
        del args
        return jax.tree.leaves(field(t, jax.tree.unflatten(structure, y)))

    controller = diffrax.PIDController(
        rtol=stepping.rtol, atol=stepping.atol, norm=optx.max_norm, dtmin=stepping.min_step, force_dtmin=False
    )
    if knots.shape[0] > 0:
        controller = diffrax.ClipStepSizeController(controller, jump_ts=knots)
    reverse = stepping.gradient == "reverse"
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(rates),
        stepping.solver,
        t0=times[0],
        t1=times[-1],
        dt0=None,
        y0=leaves,
        saveat=diffrax.SaveAt(ts=times),
        stepsize_controller=controller,
        max_steps=stepping.max_steps,
        throw=False,
        adjoint=diffrax.RecursiveCheckpointAdjoint() if reverse else diffrax.ForwardMode(),
    )
    failed = jnp.where(solution.result == diffrax.RESULTS.dt_min_reached, DIVERGED, OUT_OF_STEPS)
    ending = jnp.where(solution.result == diffrax.RESULTS.successful, COMPLETE, failed)
    return jax.tree.unflatten(structure, jax.tree.leaves(solution.ys)), ending


def _relative_size(arrays: PyTree, direction: PyTree) -> Float[Array, ""]:
    """The largest relative change of any parameter along a direction; 1 for no change at all."""

    def largest(value: Any, change: Any) -> Array:
        return jnp.max(jnp.abs(change) / jnp.where(value == 0, 1.0, jnp.abs(value)), initial=0.0)

    size = jnp.max(jnp.stack(jax.tree.leaves(jax.tree.map(largest, arrays, direction))))
    return jnp.where(size > 0, size, 1.0)


def _fit(size: Array, ndim: int) -> Array:
    return size.reshape(size.shape + (1,) * (ndim - 1))


def _no_tangent(flag: Array) -> Any:
    return np.zeros(flag.shape, dtype=jax.dtypes.float0)
