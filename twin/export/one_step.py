"""One step of a system and its outputs, as functions of flat, named numbers: what compiled exports are made of."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from twin._checks import InputError, require_x64
from twin.control.closed_loop import SampledLoop
from twin.export.names import Quantity, quantities
from twin.plant import AbstractPlant
from twin.references import MotionPoint
from twin.stepping import AbstractStepping, ConstantSteps, runge_kutta_steps


class LoopInputs(NamedTuple):
    """Inputs of a sampled loop from outside."""

    reference: MotionPoint
    """Motion that the controller follows."""
    injection: Any
    """What is added to the plant's inputs behind the controller."""


class LoopState(NamedTuple):
    """State of a sampled loop at a tick."""

    plant: Any
    """State of the plant."""
    controller: Any
    """Memory of the controller."""


@dataclass(frozen=True)
class Leaves:
    """Arrays of a structure, and the name of each of their numbers in order."""

    structure: Any
    """A structure of the same kind, for its shapes and values at the start."""
    names: tuple[Quantity, ...]
    """Name, unit and description of each number."""

    @property
    def arrays(self) -> list[Array]:
        """The arrays."""
        return [jnp.asarray(leaf) for leaf in jax.tree.leaves(self.structure)]

    @property
    def values(self) -> np.ndarray:
        """All numbers, one after the other."""
        rows = [np.ravel(np.asarray(leaf, dtype=np.float64)) for leaf in self.arrays]
        return np.concatenate(rows) if rows else np.zeros(0)

    def rebuilt(self, arrays: list[Array]) -> Any:
        """The structure with other arrays.

        Args:
            arrays: as `arrays` gives them.
        """
        return jax.tree.unflatten(jax.tree.structure(self.structure), arrays)


@dataclass(frozen=True)
class OneStep:
    """A system stepped by a constant period, its inputs held over each step.

    The functions take lists of arrays, in the order of `parameters`, `states` and `inputs`.
    """

    parameters: Leaves
    """Parameters that can be changed."""
    states: Leaves
    """State at the start, with the memory of a controller."""
    inputs: Leaves
    """Inputs at rest."""
    outputs: Leaves
    """Outputs at the start."""
    period: float
    """Length of the step [s]."""
    initial: Callable[[list, list], list]
    """(parameters, state of the plant) to the state at the start; the plant's own arrays come first in it."""
    plant_state: Callable[[list], list]
    """Parameters to the state of the plant at the start."""
    advance: Callable[[list, list, list, Array], list]
    """(parameters, states, inputs, time) to the states one period later."""
    observe: Callable[[list, list, list, Array], list]
    """(parameters, states, inputs, time) to the outputs."""


def one_step(
    system: AbstractPlant | SampledLoop,
    *,
    period: float | None = None,
    stepping: AbstractStepping | None = None,
    parameters: Iterable[str] | None = None,
) -> OneStep:
    """One step of a system as `simulate` makes it with `ConstantSteps`.

    Args:
        system: a plant, driven openly or in a closed loop; or a sampled loop without injection.
        period: length of the step [s]; of a sampled loop its own.
        stepping: constant steps, 4 to a period by default.
        parameters: dotted paths of the numbers that can be changed, or of parts of the system; of a vector all numbers
            go together. All finite ones if not given.

    Raises:
        InputError: 64-bit mode off, adaptive stepping, a period that is missing, not positive or not the loop's, a
            loop with an injection, an unknown path, something that is no plant and no sampled loop.
    """
    require_x64()
    how = ConstantSteps() if stepping is None else stepping
    if not isinstance(how, ConstantSteps):
        raise InputError(
            f"stepping must be ConstantSteps, but is {type(how).__name__}: a compiled step has one length. Let "
            "twin.simulation.choose_substeps find how many substeps are enough."
        )
    if isinstance(system, SampledLoop):
        return _loop_step(system, period, how, parameters)
    if not isinstance(system, AbstractPlant):
        raise InputError(f"system must be a plant or a SampledLoop, but is a {type(system).__name__}.")
    return _plant_step(system, _period(period), how, parameters)


def _plant_step(plant: AbstractPlant, period: float, how: ConstantSteps, wanted: Iterable[str] | None) -> OneStep:
    parameters, model = _parameters(plant, wanted, ())
    states = _named(plant.initial_state(), "state")
    inputs = _named(plant.rest_inputs(), "input")

    def advance(p: list, x: list, u: list, t: Array) -> list:
        own, held = model(p), inputs.rebuilt(u)
        after, _ = runge_kutta_steps(
            how, lambda time, y, _: own.vector_field(time, y, held), t, jnp.asarray(period), states.rebuilt(x)
        )
        return jax.tree.leaves(after)

    def observe(p: list, x: list, u: list, t: Array) -> list:
        return jax.tree.leaves(model(p).outputs(t, states.rebuilt(x), inputs.rebuilt(u)))

    outputs = _named(plant.outputs(jnp.zeros(()), states.structure, inputs.structure), "output")
    return OneStep(
        parameters,
        states,
        inputs,
        outputs,
        period,
        initial=lambda p, plant_state: plant_state,
        plant_state=lambda p: jax.tree.leaves(model(p).initial_state()),
        advance=advance,
        observe=observe,
    )


def _loop_step(loop: SampledLoop, period: float | None, how: ConstantSteps, wanted: Iterable[str] | None) -> OneStep:
    own = float(loop.period)
    if period is not None and abs(period - own) > 1e-12 * own:
        raise InputError(f"period is {period:g} s, but the sampled loop ticks every {own:g} s. Leave period out.")
    if loop.injection is not None:
        raise InputError(
            "The sampled loop has an injection, a function of time; in a compiled step what is injected is an input. "
            "Take it out by eqx.tree_at(lambda loop: loop.injection, loop, None), and feed it to the inputs."
        )
    parameters, model = _parameters(loop, wanted, ("period",))
    plant, zero = loop.plant, jnp.zeros(())
    start, tick = plant.initial_state(), jnp.asarray(own)
    memory = loop.controller.initial_state(loop.measure(zero, start), tick)
    states = _named(LoopState(start, memory), "state")
    inputs = _named(LoopInputs(MotionPoint(zero, zero, zero), plant.rest_inputs()), "input")

    def at_tick(p: list, x: list, u: list, t: Array) -> tuple[Any, Any, Any, Any]:
        loop, given, state = model(p), inputs.rebuilt(u), states.rebuilt(x)
        measured = loop.measure(t, state.plant)
        memory, command = loop.controller.update(state.controller, given.reference, measured, tick)
        return loop, state.plant, memory, loop.inputs(command, given.injection)

    def advance(p: list, x: list, u: list, t: Array) -> list:
        loop, state, memory, held = at_tick(p, x, u, t)
        field = loop.plant.vector_field
        after, _ = runge_kutta_steps(how, lambda time, y, _: field(time, y, held), t, tick, state)
        return jax.tree.leaves(LoopState(after, memory))

    def observe(p: list, x: list, u: list, t: Array) -> list:
        loop, state, _, held = at_tick(p, x, u, t)
        return jax.tree.leaves(loop.plant.outputs(t, state, held))

    def initial(p: list, plant_state: list) -> list:
        loop = model(p)
        state = jax.tree.unflatten(jax.tree.structure(start), plant_state)
        memory = loop.controller.initial_state(loop.measure(zero, state), tick)
        return jax.tree.leaves(LoopState(state, memory))

    outputs = _named(plant.outputs(zero, start, plant.rest_inputs()), "output")
    return OneStep(
        parameters,
        states,
        inputs,
        outputs,
        own,
        initial=initial,
        plant_state=lambda p: jax.tree.leaves(model(p).plant.initial_state()),
        advance=advance,
        observe=observe,
    )


def _named(structure: Any, alone: str) -> Leaves:
    return Leaves(structure, quantities(structure, alone=alone))


def _period(period: float | None) -> float:
    if period is None or not (np.isfinite(period) and period > 0):
        raise InputError(f"period must be the length of a step, above zero [s], but is {period}. Give one.")
    return float(period)


def _parameters(system: Any, wanted: Iterable[str] | None, without: tuple[str, ...]) -> tuple[Leaves, Callable]:
    """Those that can be changed, and the function from them to the system."""
    paths, structure = jax.tree_util.tree_flatten_with_path(system)
    leaves = [leaf for _, leaf in paths]
    names = _leaf_names(system, paths)
    kept = [
        i
        for i, leaf in enumerate(leaves)
        if eqx.is_inexact_array(leaf) and np.all(np.isfinite(np.asarray(leaf))) and names[i][0].name not in without
    ]
    if wanted is not None:
        kept = [i for i in kept if i in _chosen(names, tuple(wanted), kept)]
    chosen = Leaves([leaves[i] for i in kept], tuple(one for i in kept for one in names[i]))

    def model(arrays: list) -> Any:
        new = list(leaves)
        for i, array in zip(kept, arrays, strict=True):
            new[i] = array
        return jax.tree.unflatten(structure, new)

    return chosen, model


def _leaf_names(system: Any, paths: list) -> list[tuple[Quantity, ...]]:
    every, found = iter(quantities(system)), []
    for _, leaf in paths:
        found.append(tuple(next(every) for _ in range(int(jnp.size(leaf)))))
    return found


def _chosen(names: list[tuple[Quantity, ...]], wanted: tuple[str, ...], kept: list[int]) -> set[int]:
    found: set[int] = set()
    for path in wanted:
        hits = {i for i in kept if any(f"{one.name}.".startswith(f"{path}.") for one in names[i])}
        if not hits:
            known = [one.name for i in kept for one in names[i]]
            listed = ", ".join(known[:40]) + (f", ... ({len(known)} in all)" if len(known) > 40 else "")
            raise InputError(f"parameters names {path!r}, which is no finite number of the system. It has {listed}.")
        found |= hits
    return found
