"""Parameters of a model that make a cost smallest, within bounds and under constraints."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Bool, Float, Int

from fitting.constraints import (
    AbstractConstraint,
    Equality,
    Inequality,
    all_constraints,
    check_constraints,
    constraint_values,
)
from fitting.design_result import DesignResult
from fitting.solvers.slsqp import SLSQP, SLSQPState
from fitting.solvers.stop import STOPS, Stop
from twin._checks import InputError, require_x64
from twin.parameters import ParameterSpace


class DesignProblem(eqx.Module):
    """A cost and constraints, seen as functions of the scaled vector of a model's free parameters."""

    objective: Callable[[Any], Array]
    """From a model to its cost."""
    model: Any
    """Model that holds everything that is not free."""
    space: ParameterSpace
    """Free parameters."""
    constraints: tuple[AbstractConstraint, ...] = ()
    """General constraints."""
    experiment: Callable[[Any], Any] | None = None
    """From a model to what objective and constraints are functions of; None for the model itself."""

    def model_at(self, vector: Float[Array, "parameters"]) -> Any:
        """The model with its free parameters taken from the scaled vector."""
        return self.space.unpack(self.model, vector)

    def __call__(self, vector: Float[Array, "parameters"]) -> tuple[Float[Array, ""], Float[Array, "constraints"]]:
        """Cost there, and the values of the constraints, equalities first."""
        seen = seen_by(self.experiment, self.model_at(vector))
        values = [constraint_values(self.constraints, seen, kind) for kind in (Equality, Inequality)]
        return jnp.asarray(self.objective(seen), dtype=jnp.float64), jnp.concatenate(values)


class Designed(eqx.Module):
    """What the compiled part of a design returns; batches of designs are batches of this."""

    vector: Float[Array, "parameters"]
    """Scaled vector at the end."""
    cost: Float[Array, ""]
    """Cost there."""
    constraints: Float[Array, "constraints"]
    """Values of the constraints there, equalities first."""
    active: Bool[Array, "parameters"]
    """Which parameters sit on a bound that holds them back."""
    evaluations: Int[Array, ""]
    """Points evaluated."""
    gradients: Int[Array, ""]
    """Points at which the derivatives were evaluated too."""
    history: Float[Array, "history"]
    """Cost of the best point after each evaluation; NaN for those not made."""
    reason: Stop
    """Why the solver stopped."""


def design(
    model: Any,
    objective: Callable[[Any], Array],
    space: ParameterSpace,
    *,
    constraints: Sequence[AbstractConstraint] = (),
    experiment: Callable[[Any], Any] | None = None,
    max_steps: int = 100,
    solver: SLSQP | None = None,
) -> DesignResult:
    """The parameters that make a cost of a model smallest, by gradients and from where the model stands.

    Derivatives are taken forward through whatever the cost simulates, exact for its steps. A point at which a
    simulation fails is one to which no step is made. The minimum found is that of the basin of the start. Compiled once
    for each objective, structure of the model and number of constraints: define functions once at the top level.

    Args:
        model: where the design starts, and what it does not change.
        objective: from a model, or what the experiment makes of it, to its cost; pure JAX, smooth, best of the order of
            one.
        space: the free parameters with bounds; their sizes or ranges set the scale of the first step.
        constraints: conditions as `Inequality` and `Equality`. A function with `names` labels its values.
        experiment: from a model to what objective and constraints are functions of, for instance `CycleRun.of`: what
            they share is then computed, and compiled, once.
        max_steps: evaluations after the start at which to give up.
        solver: the minimiser with its tolerances; SLSQP to a promised reduction of 1e-9 of the cost if not given.

    Returns:
        The designed model with cost, constraints and number of evaluations; where it did not converge, the best point.

    Raises:
        InputError: 64-bit mode off, a start outside the bounds, an objective that is no function or does not return one
            real number, constraints that are none, max_steps below one.
    """
    require_x64()
    chosen = all_constraints(constraints)
    if max_steps < 1:
        raise InputError(f"max_steps must be at least 1, but is {max_steps}.")
    space.check_start(model)
    seen = eqx.filter_eval_shape(seen_by, experiment, model)
    _check_objective(objective, seen)
    check_constraints(chosen, seen)
    solver = SLSQP(rtol=1e-9, atol=1e-10) if solver is None else solver
    # Derivatives are counted by the history, which must therefore be complete.
    solver = dataclasses.replace(solver, history_length=max(solver.history_length, max_steps + 1))
    found = minimised(DesignProblem(objective, model, space, chosen, experiment), solver, max_steps)
    return result_of(found, model, space, _names(chosen, seen))


@eqx.filter_jit
def minimised(problem: DesignProblem, solver: SLSQP, max_steps: int) -> Designed:
    """The compiled part of a design: pure, so that it can be batched by `eqx.filter_vmap`.

    Args:
        problem: cost, constraints, start and bounds.
        solver: the minimiser.
        max_steps: evaluations after the start at which to give up.
    """
    space, start = problem.space, problem.space.pack(problem.model)
    seen = eqx.filter_eval_shape(seen_by, problem.experiment, problem.model)
    count = [
        eqx.filter_eval_shape(constraint_values, problem.constraints, seen, kind).size
        for kind in (Equality, Inequality)
    ]
    solution = optx.minimise(
        _cost_of,
        solver,
        start,
        args=problem,
        options={"lower": space.lower, "upper": space.upper, "in_aux": tuple(count)},
        max_steps=max_steps + 1,  # the first: the start
        has_aux=True,
        throw=False,
    )
    state: SLSQPState = solution.state
    reason = solution.stats["reason"]
    known = reason != Stop.not_finite
    # A derivative is taken where a point is accepted, and there the cost changes.
    changes = jnp.sum(jnp.diff(state.history) != 0, where=jnp.isfinite(jnp.diff(state.history)))
    return Designed(
        vector=solution.value,
        cost=jnp.where(known, state.here.value, jnp.nan),
        constraints=jnp.where(known, state.here.constraints, jnp.nan),
        active=state.active,
        evaluations=state.steps + 1,
        gradients=1 + changes,
        history=jnp.where(known, state.history, jnp.nan),
        reason=reason,
    )


def result_of(
    found: Designed, model: Any, space: ParameterSpace, names: tuple[str, ...], note: str = ""
) -> DesignResult:
    """What a compiled design found, in the caller's terms.

    Args:
        found: by `minimised`.
        model: where it started.
        space: the free parameters.
        names: of the values of the constraints, equalities first.
        note: what else there is to say.
    """
    evaluations = int(found.evaluations)
    values = space.unscaled(found.vector)
    return DesignResult(
        model=space.with_values(model, values),
        space=space,
        start=np.asarray(space.values(model)),
        values=np.asarray(values),
        cost=float(found.cost),
        history=np.asarray(found.history)[:evaluations],
        evaluations=evaluations,
        gradients=int(found.gradients),
        active=np.asarray(found.active),
        constraint_names=names,
        constraint_values=np.asarray(found.constraints),
        stop=next(name for name in STOPS if found.reason == getattr(Stop, name)),
        note=note,
    )


def seen_by(experiment: Callable[[Any], Any] | None, model: Any) -> Any:
    """What objective and constraints are functions of.

    Args:
        experiment: from a model to that; None for the model itself.
        model: the model.
    """
    return model if experiment is None else experiment(model)


def _check_objective(objective: Any, model: Any) -> None:
    if not callable(objective):
        raise InputError(f"objective must be a function of the model, but is a {type(objective).__name__}.")
    shape = jax.eval_shape(eqx.filter_jit(objective), model)
    if not (
        isinstance(shape, jax.ShapeDtypeStruct) and shape.shape == () and jnp.issubdtype(shape.dtype, jnp.floating)
    ):
        seen = f"{shape.dtype}{list(shape.shape)}" if isinstance(shape, jax.ShapeDtypeStruct) else type(shape).__name__
        raise InputError(f"objective returns {seen}, but a design needs one real number. Weigh or sum what it returns.")


def _names(constraints: tuple[AbstractConstraint, ...], model: Any) -> tuple[str, ...]:
    """Names of all values, equalities first as the solver has them."""
    names = []
    for kind in (Equality, Inequality):
        for i, constraint in enumerate(constraints):
            if not isinstance(constraint, kind):
                continue
            size = int(eqx.filter_eval_shape(constraint.function, model).size)
            given = getattr(constraint.function, "names", None)
            fallback = getattr(constraint.function, "__name__", f"constraint {i}")
            plain = (fallback,) if size == 1 else tuple(f"{fallback}.{k}" for k in range(size))
            names += given if given is not None and len(given) == size else plain
    return tuple(names)


def _cost_of(vector: Array, problem: DesignProblem) -> tuple[Array, Array]:
    return problem(vector)
