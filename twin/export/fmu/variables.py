"""The variables of an FMU: their order, their names and what may be done with them."""

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from jax.interpreters import partial_eval
from jaxtyping import Array

from twin._checks import InputError
from twin.export.names import Quantity
from twin.export.one_step import Leaves, OneStep


@dataclass(frozen=True)
class Variable:
    """One number of an FMU; its place in the list is its value reference."""

    name: str
    """Its name."""
    unit: str
    """Its unit, empty if not known."""
    description: str
    """What it is."""
    causality: str
    """FMI's word: "independent", "parameter", "input", "output" or "local"."""
    variability: str
    """FMI's word: "fixed", "tunable" or "continuous"."""
    start: float | None
    """Value at the start, of what can be set."""
    listed: bool = True
    """Whether it is in the description; a parameter that nothing depends on is not."""
    inputs: tuple[int, ...] = ()
    """Of an output, value references of the inputs that act on it at once."""


@dataclass(frozen=True)
class Layout:
    """All variables, and which run of them is what."""

    variables: tuple[Variable, ...]
    """Time, parameters, initial states, inputs, outputs and states, in this order."""
    parameters: int
    """Place of the first parameter."""
    initial: int
    """Place of the first initial state."""
    inputs: int
    """Place of the first input."""
    outputs: int
    """Place of the first output."""
    states: int
    """Place of the first state."""
    settable: tuple[int, ...]
    """Which arrays of the plant's state at the start can be set, as no parameter says what they are."""


def layout(step: OneStep, rename: Mapping[str, str]) -> Layout:
    """The variables of a step.

    Args:
        step: the step.
        rename: other names for variables, by name.

    Raises:
        InputError: two variables of one name, a name to change that is not there.
    """
    settable = _settable(step)
    used, tunable = _used_parameters(step, settable)
    plant = _plant_names(step)
    found = [Variable("time", "s", "Time", "independent", "continuous", None)]
    for i, (names, values) in enumerate(_by_array(step.parameters)):
        kind = "tunable" if tunable[i] else "fixed"
        found += [_variable(q, "", "parameter", kind, value, used[i]) for q, value in zip(names, values, strict=True)]
    initial = len(found)
    for i in settable:
        names, values = plant[i]
        found += [_variable(q, "initial.", "parameter", "fixed", v) for q, v in zip(names, values, strict=True)]
    inputs = len(found)
    # Those of a sampled loop have names of their own: reference.position, injection.load.
    prefix = "" if any(q.name.startswith("reference.") for q in step.inputs.names) else "input."
    found += [
        _variable(q, prefix, "input", "continuous", value)
        for q, value in zip(step.inputs.names, step.inputs.values, strict=True)
    ]
    outputs = len(found)
    through = _feed_through(step, inputs)
    found += [
        _variable(q, "", "output", "continuous", None, True, t)
        for q, t in zip(step.outputs.names, through, strict=True)
    ]
    states = len(found)
    found += [_variable(q, "state.", "local", "continuous", None) for q in step.states.names]
    return Layout(_renamed(found, rename), 1, initial, inputs, outputs, states, settable)


def _variable(
    q: Quantity,
    prefix: str,
    causality: str,
    variability: str,
    start: float | None,
    listed: bool = True,
    inputs: tuple[int, ...] = (),
) -> Variable:
    value = None if start is None else float(start)
    return Variable(prefix + q.name, q.unit, q.description, causality, variability, value, listed, inputs)


def _renamed(found: list[Variable], rename: Mapping[str, str]) -> tuple[Variable, ...]:
    known = {variable.name for variable in found if variable.listed}
    for name in rename:
        if name not in known:
            raise InputError(
                f"rename names {name!r}, but there is no such variable. There are {', '.join(sorted(known))}."
            )
    named = [dataclasses.replace(one, name=rename.get(one.name, one.name)) if one.listed else one for one in found]
    seen: set[str] = set()
    for variable in named:
        if variable.listed and variable.name in seen:
            raise InputError(
                f"Two variables are called {variable.name!r} ({variable.causality} is the second). Give one of them "
                "another name by rename."
            )
        if not variable.name or not variable.name.isprintable():
            raise InputError(f"{variable.name!r} cannot name a variable. Give printable characters.")
        if variable.listed:
            seen.add(variable.name)
    return tuple(named)


def _by_array(leaves: Leaves) -> list[tuple[tuple[Quantity, ...], np.ndarray]]:
    """Names and values of each array."""
    found, begin = [], 0
    for array in leaves.arrays:
        found.append((leaves.names[begin : begin + array.size], np.ravel(np.asarray(array, dtype=float))))
        begin += array.size
    return found


def _plant_names(step: OneStep) -> list[tuple[tuple[Quantity, ...], np.ndarray]]:
    """Names and values of the plant's state at the start, which comes first in the whole state."""
    return _by_array(step.states)[: len(plant_state(step))]


def plant_state(step: OneStep) -> list[Array]:
    """The plant's state at the start.

    Args:
        step: the step.
    """
    return step.plant_state(step.parameters.arrays)


def _program(function: Callable, *groups: Any) -> Any:
    return jax.make_jaxpr(function)(*groups).jaxpr


def _dependence(program: Any, results: list[int]) -> list[bool]:
    """For each argument, whether any of these results depends on it."""
    wanted = [i in results for i in range(len(program.outvars))]
    return list(partial_eval.dce_jaxpr(program, wanted)[1])


def _settable(step: OneStep) -> tuple[int, ...]:
    program = _program(step.plant_state, step.parameters.arrays)
    return tuple(i for i in range(len(program.outvars)) if not any(_dependence(program, [i])))


def _used_parameters(step: OneStep, settable: tuple[int, ...]) -> tuple[list[bool], list[bool]]:
    """For each array of parameters, whether anything depends on it, and whether the steps do."""
    p, x, u, t = step.parameters.arrays, step.states.arrays, step.inputs.arrays, jax.numpy.zeros(())
    runs = [_program(f, p, x, u, t) for f in (step.advance, step.observe)]
    steps = [_dependence(run, list(range(len(run.outvars))))[: len(p)] for run in runs]
    start = _program(step.initial, p, plant_state(step))
    begins = [_dependence(start, list(range(len(start.outvars))))[: len(p)]]
    plant = _program(step.plant_state, p)
    begins.append(_dependence(plant, [i for i in range(len(plant.outvars)) if i not in settable]))
    tunable = [any(column) for column in zip(*steps, strict=True)]
    return [any(column) for column in zip(*steps, *begins, strict=True)], tunable


def _feed_through(step: OneStep, first: int) -> list[tuple[int, ...]]:
    """For each output, value references of the inputs that act on it without a step between."""
    p, x, u, t = step.parameters.arrays, step.states.arrays, step.inputs.arrays, jax.numpy.zeros(())
    program, found = _program(step.observe, p, x, u, t), []
    places = np.split(first + np.arange(sum(a.size for a in u)), np.cumsum([a.size for a in u])[:-1])
    for number, result in enumerate(program.outvars):
        acting = _dependence(program, [number])[len(p) + len(x) : len(p) + len(x) + len(u)]
        through = tuple(int(r) for place, acts in zip(places, acting, strict=True) if acts for r in place)
        found += [through] * int(np.prod(result.aval.shape))
    return found
