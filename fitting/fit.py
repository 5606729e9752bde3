"""From data to parameters: the front door of fitting."""

from collections.abc import Iterable, Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from fitting.constraints import AbstractConstraint, all_constraints, check_constraints
from fitting.residuals.residual import AbstractResidual
from fitting.result import FitResult
from fitting.solve import Solved, Solver, solve
from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt
from fitting.solvers.slsqp import SLSQP
from fitting.solvers.stop import STOPS, Stop
from fitting.uncertainty import covariance_of
from twin._checks import InputError, require_x64
from twin.parameters import ParameterSpace


class FitError(RuntimeError):
    """A fit that did not converge, where the caller asked to be told by an exception."""


def fit(
    residual: AbstractResidual,
    model: Any,
    space: ParameterSpace,
    *,
    constraints: Sequence[AbstractConstraint] = (),
    solver: Solver | None = None,
    max_steps: int = 100,
    hold: Iterable[str] = (),
    correlated: int | None = None,
    variance: str = "estimated",
    throw: bool = False,
) -> FitResult:
    """Fit the free parameters of a model to data, by least squares within bounds and general constraints.

    Args:
        residual: evidence; called with a model, it returns the weighted residual.
        model: start of the fit; what is not free stays as it is here.
        space: free parameters.
        constraints: conditions on the model, `Equality(function)` or `Inequality(function)`; the functions are defined
            once and kept (a new lambda for every fit compiles anew).
        solver: `BoundedLevenbergMarquardt` or `SLSQP`, with their settings. By default the former, which knows that the
            cost is a sum of squares; the latter where there are general constraints.
        max_steps: steps after which the fit is given up.
        hold: paths of the space to hold at their start this time. A ladder of models that differ in what is free is
            then compiled once.
        correlated: number of equally long series, one after the other, that the residual consists of, if its errors
            hang together from sample to sample (a model error over time does); the covariance then allows for it. By
            default errors count as independent.
        variance: "estimated" from the residual, or "known" where the weights are exact.
        throw: raise if the fit did not converge, instead of marking the result.

    Returns:
        The fitted model with estimates, their uncertainty and a status.

    Raises:
        InputError: unknown path, start outside its bounds, fewer data than parameters, a constraint that returns no
            vector, constraints for a solver that takes none.
        FitError: with `throw`, a fit that did not converge.
    """
    require_x64()
    space.check_start(model)
    constraints = all_constraints(constraints)
    solver = chosen_solver(solver, constraints)
    check_residual(residual, model, space)
    check_constraints(constraints, model)
    held = {hold} if isinstance(hold, str) else set(hold)
    if len(held) == len(space.subset(held) if held else ()) == len(space):
        raise InputError("All parameters of the space are held; nothing is left to fit.")
    mask = jnp.asarray([path in held for path in space.paths])
    solved = solve(residual, model, space, solver, max_steps, mask, constraints)
    result = result_of(solved, model, space, hold=held, correlated=correlated, variance=variance)
    if throw and not result.success:
        raise FitError(f"The fit did not succeed. {result.message}")
    return result


def result_of(
    solved: Solved,
    model: Any,
    space: ParameterSpace,
    *,
    hold: Iterable[str] = (),
    correlated: int | None = None,
    variance: str = "estimated",
) -> FitResult:
    """The result of one fit, from what its compiled part returned.

    Args:
        solved: of one fit (index a batch first).
        model: start of the fit.
        space: free parameters.
        hold: as in `fit`.
        correlated: as in `fit`.
        variance: as in `fit`.
    """
    residual, jacobian, stop = np.asarray(solved.residual), np.asarray(solved.jacobian), name_of(solved.reason)
    if stop == "not_finite":
        # A solver may leave there what it was made with: zeros, which would look like a perfect fit.
        residual, jacobian = np.full_like(residual, np.nan), np.full_like(jacobian, np.nan)
    history = np.asarray(solved.history)
    values = space.unscaled(solved.vector)
    held = set(hold)
    priors = sum(p.prior is not None for p in space.parameters)
    free = np.flatnonzero([path not in held for path in space.paths])
    # A step that was not made may have ended on a bound where the fit did not.
    active = (np.asarray(solved.active) & _on_bound(np.asarray(solved.vector), space))[free]
    covariance = covariance_of(
        residual,
        jacobian[:, free],
        active,
        series=correlated,
        priors=priors,
        curvature=None if solved.curvature is None else np.asarray(solved.curvature),
        normals=np.asarray(solved.normals)[:, free],
        variance=variance,
    )
    return FitResult(
        model=space.with_values(model, values),
        space=space.subset([space.paths[i] for i in free]),
        values=np.asarray(values)[free],
        scaled=np.asarray(solved.vector)[free],
        scaled_covariance=covariance.matrix,
        factor=_factor(jacobian[:, free]),
        condition_number=covariance.condition_number,
        degrees_of_freedom=covariance.degrees_of_freedom,
        unseen=covariance.unseen,
        active=active,
        residual=residual,
        cost_history=history[np.isfinite(history)],
        steps=int(solved.steps),
        stop=stop,
        offset=float(solved.offset),
        variance=variance,
        correlated=correlated is not None,
    )


def _factor(jacobian: np.ndarray) -> np.ndarray:
    if not np.all(np.isfinite(jacobian)):
        return np.full((jacobian.shape[1],) * 2, np.nan)
    short = max(0, jacobian.shape[1] - jacobian.shape[0])
    return np.asarray(np.linalg.qr(np.vstack([jacobian, np.zeros((short, jacobian.shape[1]))]), mode="r"))


def name_of(reason: Stop) -> str:
    """Name of a reason for stopping, as it is kept in results.

    Args:
        reason: of one fit.
    """
    for name in STOPS:
        if bool(reason == getattr(Stop, name)):
            return name
    raise AssertionError("unknown reason")  # pragma: no cover


def chosen_solver(solver: Solver | None, constraints: tuple[AbstractConstraint, ...]) -> Solver:
    """The solver to use: by default Levenberg-Marquardt, and SLSQP where there are general constraints.

    Args:
        solver: the user's choice, if any.
        constraints: general constraints.

    Raises:
        InputError: constraints for a solver that takes none.
    """
    if solver is None:
        return SLSQP() if constraints else BoundedLevenbergMarquardt()
    if constraints and not isinstance(solver, SLSQP):
        raise InputError(f"{type(solver).__name__} takes no general constraints. Use SLSQP, or leave the solver out.")
    return solver


@eqx.filter_jit
def _twice(residual: AbstractResidual, model: Any) -> tuple[Any, Any]:
    """Compiled for the sake of the cache: the next fit of this structure is checked without being traced."""
    return residual(model), residual(model)


def check_residual(residual: AbstractResidual, model: Any, space: ParameterSpace) -> int:
    """Raise unless a residual is a vector with at least as many entries as there are parameters.

    Args:
        residual: as in `fit`.
        model: as in `fit`.
        space: as in `fit`.

    Returns:
        The number of residuals, priors not counted.

    Raises:
        InputError: naming what is wrong.
    """
    shape, again = eqx.filter_eval_shape(_twice, residual, model)
    if shape.shape != again.shape:
        raise InputError(
            f"The residual changes its shape from call to call ({shape.shape}, then {again.shape}). Fix which samples "
            "count before the fit, and weigh by zero what is to be left out."
        )
    priors = sum(p.prior is not None for p in space.parameters)
    if len(shape.shape) != 1:
        raise InputError(f"A residual must be a vector, but this one has shape {shape.shape}.")
    if shape.shape[0] == 0:
        raise InputError("The residual is empty: there are no data to fit. Look at what the record or band leaves.")
    if shape.shape[0] + priors < len(space):
        raise InputError(
            f"{shape.shape[0]} residuals cannot determine {len(space)} parameters. "
            "Add data or priors, or free fewer parameters."
        )
    return shape.shape[0]


def _on_bound(vector: np.ndarray, space: ParameterSpace) -> np.ndarray:
    """Which entries of a scaled vector sit on a bound, to rounding."""
    lower, upper = np.asarray(space.lower), np.asarray(space.upper)
    near = 1e-9 * (1 + np.abs(vector))
    return (vector <= lower + near) | (vector >= upper - near)
