"""The compiled part of a fit: pure functions that can be batched."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Bool, Float, Int

from fitting.constraints import AbstractConstraint, Equality, Inequality
from fitting.objective import Objective, cost_of, equality_of, inequality_of, residual_of
from fitting.residuals.residual import AbstractResidual
from fitting.solvers.factor import triangular_factor
from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt, BoundedState
from fitting.solvers.slsqp import SLSQP, SLSQPState
from fitting.solvers.stop import Stop
from twin.parameters import ParameterSpace

Solver = BoundedLevenbergMarquardt | SLSQP
"""Solvers that fits are made with."""


class Solved(eqx.Module):
    """What the compiled part of a fit returns; batches of fits are batches of this."""

    vector: Float[Array, "parameters"]
    """Scaled vector at the end."""
    residual: Float[Array, "residuals"]
    """Weighted residual there, priors at the end."""
    jacobian: Float[Array, "residuals parameters"]
    """Its Jacobian."""
    curvature: Float[Array, "data"] | None
    """Curvature of robust losses, row by row; None without."""
    normals: Float[Array, "constraints parameters"]
    """Gradients of the constraints that hold; zero rows for those that do not."""
    active: Bool[Array, "parameters"]
    """Which parameters sit on a bound that holds them back."""
    offset: Float[Array, ""]
    """√(promised reduction / cost) at the end."""
    steps: Int[Array, ""]
    """Steps taken: evaluations after that of the start."""
    history: Float[Array, "history"]
    """Cost after each step; NaN for steps not taken."""
    reason: Stop
    """Why the solver stopped."""


@eqx.filter_jit
def solve(
    residual: AbstractResidual,
    model: Any,
    space: ParameterSpace,
    solver: Solver,
    max_steps: int,
    held: Bool[Array, "parameters"] | None = None,
    constraints: tuple[AbstractConstraint, ...] = (),
) -> Solved:
    """The compiled part of a fit: pure, so that it can be batched by `eqx.filter_vmap`.

    Args:
        residual: as in `fit`.
        model: as in `fit`.
        space: as in `fit`.
        solver: as in `fit`.
        max_steps: as in `fit`.
        held: which parameters stay at their start.
        constraints: as in `fit`.
    """
    return solve_raw(residual, model, space, solver, max_steps, held, constraints)


def solve_raw(
    residual: AbstractResidual,
    model: Any,
    space: ParameterSpace,
    solver: Solver,
    max_steps: int,
    held: Bool[Array, "parameters"] | None = None,
    constraints: tuple[AbstractConstraint, ...] = (),
) -> Solved:
    """`solve` without its own compilation, for use inside other compiled functions."""
    objective = Objective(residual, model, space, constraints)
    start, lower, upper = space.pack(model), space.lower, space.upper
    if held is not None:
        # Bounds that meet at the start hold a parameter, and the compiled program stays the same.
        lower, upper = jnp.where(held, start, lower), jnp.where(held, start, upper)
    common = {"args": objective, "max_steps": max_steps + 1, "throw": False, "has_aux": True}  # the first: the start
    if isinstance(solver, BoundedLevenbergMarquardt):
        solution = optx.least_squares(residual_of, solver, start, options={"lower": lower, "upper": upper}, **common)
    else:
        factor = _gauss_newton_factor(objective, start)
        options = {**options_of(objective, lower, upper), "factor": factor}
        solution = optx.minimise(cost_of, solver, start, options=options, **common)
    return outcome(solution.value, solution.state, solution.stats["reason"], objective)


def options_of(objective: Objective, lower: Array, upper: Array) -> dict:
    """What `SLSQP` is told of the bounds and constraints.

    Args:
        objective: of the fit.
        lower: lower bounds of the scaled vector.
        upper: upper bounds.
    """
    options: dict[str, Any] = {"lower": lower, "upper": upper}
    if any(isinstance(c, Equality) for c in objective.constraints):
        options["equality"] = equality_of
    if any(isinstance(c, Inequality) for c in objective.constraints):
        options["inequality"] = inequality_of
    return options


def outcome(vector: Array, state: BoundedState | SLSQPState, reason: Stop, objective: Objective) -> Solved:
    """What a solver's last state says.

    Args:
        vector: scaled vector at the end.
        state: the solver's state there.
        reason: why it stopped.
        objective: of the fit.
    """
    if isinstance(state, BoundedState):
        return Solved(
            vector=vector,
            residual=state.residual,
            jacobian=state.jacobian,
            curvature=state.aux,
            normals=jnp.zeros((0, vector.size)),
            active=state.active,
            offset=state.offset,
            steps=state.steps,
            history=state.history,
            reason=reason,
        )
    jacobian, (values, curvature) = linearised_raw(objective, vector)
    equalities = objective.equality(vector).size
    holds = (jnp.arange(state.multipliers.size) < equalities) | (state.multipliers > 0)
    cost = jnp.maximum(state.here.value, jnp.finfo(vector.dtype).tiny)
    return Solved(
        vector=vector,
        residual=values,
        jacobian=jacobian,
        curvature=curvature,
        normals=jnp.where(holds[:, None], state.here.normals, 0.0),
        active=state.active,
        offset=jnp.sqrt(jnp.maximum(state.promised, 0.0) / cost),
        steps=state.steps,
        history=state.history,
        reason=reason,
    )


@eqx.filter_jit
def linearised(objective: Objective, vector: Array) -> tuple[Array, tuple[Array, Array | None]]:
    """Jacobian of the residual, with the residual and the curvature of its losses.

    Args:
        objective: of the fit.
        vector: scaled vector.
    """
    return linearised_raw(objective, vector)


def linearised_raw(objective: Objective, vector: Array) -> tuple[Array, tuple[Array, Array | None]]:
    """`linearised` without its own compilation, for use inside other compiled functions."""

    def function(x: Array) -> tuple[Array, tuple[Array, Array | None]]:
        values, curvature = objective(x)
        return values, (values, curvature)

    return jax.jacfwd(function, has_aux=True)(vector)


def _gauss_newton_factor(objective: Objective, start: Array) -> Array:
    """Lower triangular factor of the Gauss-Newton Hessian at the start, a little of the identity added."""
    jacobian, _ = linearised_raw(objective, start)
    size = jnp.sqrt(jnp.sum(jacobian**2, axis=0))
    largest = jnp.maximum(jnp.max(size), jnp.finfo(start.dtype).tiny)
    damping = 1e-4 * jnp.maximum(size, 1e-4 * largest)
    rows = jnp.concatenate([jacobian, jnp.diag(damping)])
    good = jnp.all(jnp.isfinite(rows))
    return jnp.where(good, triangular_factor(jnp.where(good, rows, 1.0)).T, jnp.eye(start.size))
