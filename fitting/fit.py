"""From data to parameters: the front door of fitting."""

from collections.abc import Iterable
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Bool, Float

from fitting.residuals.residual import AbstractResidual
from fitting.result import FitResult
from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt, BoundedState, Stop
from fitting.uncertainty import covariance_of
from twin._checks import InputError, require_x64
from twin.parameters import ParameterSpace

Model = TypeVar("Model")


class Solved(eqx.Module):
    """What the compiled part of a fit returns; batches of fits are batches of this."""

    vector: Float[Array, "parameters"]
    """Scaled vector at the end."""
    state: BoundedState
    """Final state of the solver: residual, Jacobian, active bounds, history."""
    reason: Stop
    """Why the solver stopped."""


def fit(
    residual: AbstractResidual,
    model: Any,
    space: ParameterSpace,
    *,
    solver: BoundedLevenbergMarquardt | None = None,
    max_steps: int = 100,
    hold: Iterable[str] = (),
    correlated: int | None = None,
    throw: bool = False,
) -> FitResult:
    """Fit the free parameters of a model to data, by least squares within bounds.

    Args:
        residual: evidence; called with a model, it returns the weighted residual.
        model: start of the fit; what is not free stays as it is here.
        space: free parameters.
        solver: settings of the Levenberg-Marquardt solver.
        max_steps: steps after which the fit is given up.
        hold: paths of the space to hold at their start this time. A ladder of models that differ in what is free is
            then compiled once.
        correlated: number of equally long series, one after the other, that the residual consists of, if its errors
            hang together from sample to sample (a model error over time does); the covariance then allows for it. By
            default errors count as independent.
        throw: raise if the fit did not converge, instead of marking the result.

    Returns:
        The fitted model with estimates, their uncertainty and a status.

    Raises:
        InputError: unknown path, start outside its bounds, fewer data than parameters; with `throw`, a fit that did not
            converge.
    """
    require_x64()
    space.check_start(model)
    solver = BoundedLevenbergMarquardt() if solver is None else solver
    _check_residual(residual, model, space)
    held = {hold} if isinstance(hold, str) else set(hold)
    if len(held) == len(space.subset(held) if held else ()) == len(space):
        raise InputError("All parameters of the space are held; nothing is left to fit.")
    mask = jnp.asarray([path in held for path in space.paths])
    solved = solve(residual, model, space, solver, max_steps, mask)
    result = result_of(solved, model, space, hold=held, correlated=correlated)
    if throw and not result.success:
        raise InputError(f"The fit did not succeed. {result.message}")
    return result


@eqx.filter_jit
def solve(
    residual: AbstractResidual,
    model: Any,
    space: ParameterSpace,
    solver: BoundedLevenbergMarquardt,
    max_steps: int,
    held: Bool[Array, "parameters"] | None = None,
) -> Solved:
    """The compiled part of a fit: pure, so that it can be batched by `eqx.filter_vmap`.

    Args:
        residual: as in `fit`.
        model: as in `fit`.
        space: as in `fit`.
        solver: as in `fit`.
        max_steps: as in `fit`.
        held: which parameters stay at their start.
    """
    return solve_raw(residual, model, space, solver, max_steps, held)


def solve_raw(
    residual: AbstractResidual,
    model: Any,
    space: ParameterSpace,
    solver: BoundedLevenbergMarquardt,
    max_steps: int,
    held: Bool[Array, "parameters"] | None = None,
) -> Solved:
    """`solve` without its own compilation, for use inside other compiled functions."""

    def objective(vector: Array, args: Any) -> Array:
        evidence, start = args
        values = space.unscaled(vector)
        return jnp.concatenate([evidence(space.with_values(start, values)), space.prior_residual(values)])

    start, lower, upper = space.pack(model), space.lower, space.upper
    if held is not None:
        # Bounds that meet at the start hold a parameter, and the compiled program stays the same.
        lower, upper = jnp.where(held, start, lower), jnp.where(held, start, upper)
    solution = optx.least_squares(
        objective,
        solver,
        start,
        args=(residual, model),
        options={"lower": lower, "upper": upper},
        max_steps=max_steps + 1,  # the first evaluates the start
        throw=False,
    )
    return Solved(solution.value, solution.state, solution.stats["reason"])


def result_of(
    solved: Solved, model: Any, space: ParameterSpace, *, hold: Iterable[str] = (), correlated: int | None = None
) -> FitResult:
    """The result of one fit, from what its compiled part returned.

    Args:
        solved: of one fit (index a batch first).
        model: start of the fit.
        space: free parameters.
        hold: as in `fit`.
        correlated: as in `fit`.
    """
    state = solved.state
    history = np.asarray(state.history)
    values = space.unscaled(solved.vector)
    held = set(hold)
    priors = sum(p.prior is not None for p in space.parameters)
    free = np.flatnonzero([path not in held for path in space.paths])
    covariance = covariance_of(
        state.residual,
        np.asarray(state.jacobian)[:, free],
        np.asarray(state.active)[free],
        series=correlated,
        priors=priors,
    )
    return FitResult(
        model=space.with_values(model, values),
        space=space.subset([space.paths[i] for i in free]),
        values=np.asarray(values)[free],
        scaled=np.asarray(solved.vector)[free],
        scaled_covariance=covariance.matrix,
        condition_number=covariance.condition_number,
        degrees_of_freedom=covariance.degrees_of_freedom,
        unseen=covariance.unseen,
        active=np.asarray(state.active)[free],
        residual=np.asarray(state.residual),
        cost_history=history[np.isfinite(history)],
        steps=int(state.steps),
        stop=_name_of(solved.reason),
        offset=float(state.offset),
    )


def _name_of(reason: Stop) -> str:
    for name in ("running", "converged", "at_precision", "stalled", "not_finite", "too_many_steps"):
        if bool(reason == getattr(Stop, name)):
            return name
    raise AssertionError("unknown reason")  # pragma: no cover


def _check_residual(residual: AbstractResidual, model: Any, space: ParameterSpace) -> None:
    shape = jax.eval_shape(eqx.filter_jit(residual), model)
    priors = sum(p.prior is not None for p in space.parameters)
    if len(shape.shape) != 1:
        raise InputError(f"A residual must be a vector, but this one has shape {shape.shape}.")
    if shape.shape[0] + priors < len(space):
        raise InputError(
            f"{shape.shape[0]} residuals cannot determine {len(space)} parameters. "
            "Add data or priors, or free fewer parameters."
        )
