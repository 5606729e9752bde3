"""Profile likelihood: how the best cost rises when one parameter is moved and all others follow."""

import dataclasses
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.constraints import AbstractConstraint, all_constraints
from fitting.fit import chosen_solver
from fitting.objective import Objective
from fitting.profile_search import ProfileSearch
from fitting.residuals.residual import AbstractResidual
from fitting.result import FitResult
from fitting.solve import Solver, linearised
from twin._checks import InputError

if TYPE_CHECKING:
    import pandas as pd


@dataclasses.dataclass(frozen=True)
class Profile:
    """Profile of one parameter."""

    path: str
    """The parameter."""
    unit: str
    """Its unit."""
    estimate: float
    """Value of the fit."""
    values: np.ndarray
    """Values at which the parameter was held, rising, the estimate among them (points,)."""
    ratio: np.ndarray
    """Signed square root of twice the rise of the cost over the variance: the profile t (Bates and Watts), which is
    a straight line where linear theory holds (points,)."""
    others: np.ndarray
    """All parameters at each point, SI (points, parameters)."""
    interval: tuple[float, float]
    """Interval of the profile; infinite (or the bound) on a side where the data set no limit."""
    open: tuple[bool, bool]
    """Whether the interval ends on the lower, upper side at a bound or not at all, and not where the cost says so."""


@dataclasses.dataclass(frozen=True, repr=False)
class ProfileResult:
    """Profiles of several parameters. Shows itself as a table in a notebook."""

    profiles: tuple[Profile, ...]
    """The profiles."""
    level: float
    """Confidence of the intervals."""
    critical: float
    """|ratio| at which the intervals end."""
    lower_cost: float | None
    """A cost below that of the fit, if a profile met one: the fit was no minimum."""
    message: str
    """What else there is to say."""

    def __getitem__(self, path: str) -> Profile:
        for profile in self.profiles:
            if profile.path == path:
                return profile
        raise InputError(f"{path!r} was not profiled; these were: {', '.join(p.path for p in self.profiles)}.")

    def to_dataframe(self) -> "pd.DataFrame":
        """Table of the intervals."""
        import pandas as pd

        rows = [
            [
                p.unit,
                p.estimate,
                *p.interval,
                " and ".join(s for s, o in zip(("below", "above"), p.open, strict=True) if o),
            ]
            for p in self.profiles
        ]
        names = ["unit", "estimate", f"{100 * self.level:g} % from", f"{100 * self.level:g} % to", "no limit"]
        return pd.DataFrame(rows, columns=names, index=pd.Index([p.path for p in self.profiles], name="parameter"))

    def _repr_html_(self) -> str:
        table = self.to_dataframe().to_html(float_format=lambda x: f"{x:.6g}")
        return f"<div><p><b>Profile likelihood</b> {self.message}</p>{table}</div>"

    def __repr__(self) -> str:
        return f"{self.to_dataframe().to_string(float_format=lambda x: f'{x:.6g}')}\n{self.message}".strip()


def profile(
    residual: AbstractResidual,
    result: FitResult,
    *,
    parameters: str | Iterable[str] | None = None,
    level: float = 0.95,
    variance: str = "estimated",
    constraints: Sequence[AbstractConstraint] = (),
    solver: Solver | None = None,
    max_steps: int = 50,
    points: int = 8,
    rounds: int = 40,
) -> ProfileResult:
    """Profile likelihood of a fit, with intervals that need no linear theory.

    Each parameter is held at values around its estimate while all others are fitted again, all parameters and both
    sides as one batch. The interval ends where the cost says so: 2·(C - Ĉ)/s² = t² (D. M. Bates and D. G. Watts,
    "Nonlinear Regression Analysis and Its Applications", 1988, section 6.1). Errors are taken to be independent. With
    robust losses, whose cost is no likelihood, s² is such that near the estimate the profile agrees with the fit's
    standard error.

    Args:
        residual: the evidence that was fitted.
        result: the fit.
        parameters: paths to profile, or one path; all if not given.
        level: confidence of the intervals, between 0 and 1.
        variance: "estimated" from the residual, or "known" where the weights are exact.
        constraints: as in the fit.
        solver: as in the fit.
        max_steps: steps of each fit.
        points: points on each side besides those that the search for the ends needs.
        rounds: most rounds of that search, each a batch of one fit for each end not found yet.

    Returns:
        The profiles.

    Raises:
        InputError: a fit that did not converge, evidence or constraints that are not those of the fit, a parameter
            that was not fitted, level outside (0, 1), no degrees of freedom to estimate a variance from, robust losses
            together with a known variance or constraints.
    """
    space = result.space
    parameters = (parameters,) if isinstance(parameters, str) else parameters
    paths = tuple(dict.fromkeys(space.paths if parameters is None else parameters))
    for path in paths:
        result[path]
    if not 0 < level < 1:
        raise InputError(f"level must be between 0 and 1, but is {level}.")
    if not result.success:
        raise InputError(f"A profile starts from a minimum, but this fit is none. {result.message}")
    if variance not in ("estimated", "known"):
        raise InputError(f'variance must be "estimated" or "known", but is {variance!r}.')
    if variance == "estimated" and result.degrees_of_freedom < 1:
        raise InputError('No data are left over to estimate a variance from. Use variance="known", or add data.')
    constraints = all_constraints(constraints)
    objective = Objective(residual, result.model, space, constraints)
    search = ProfileSearch(
        objective=objective,
        result=result,
        indices=[space.paths.index(path) for path in paths],
        squares=_squares(objective, result, variance),
        critical=_critical(level, None if variance == "known" else result.degrees_of_freedom),
        solver=chosen_solver(solver, constraints),
        max_steps=max_steps,
    )
    for _ in range(rounds):
        if not search.advance():
            break
    search.fill(points)
    unsettled = search.unsettled()
    found = tuple(_profile(search, path, i) for path, i in zip(paths, search.indices, strict=True))
    lowest = search.lowest
    fell = lowest < result.cost * (1 - 1e-6)
    message = (
        f"A profile met the cost {lowest:.6g}, below the fit's {result.cost:.6g}: the fit was not the best minimum. "
        "Start again from several points."
        if fell
        else ""
    )
    if unsettled:
        message = f"{message} The search for the ends ran out of rounds at {', '.join(unsettled)}.".strip()
    if lost := search.failing():
        message = (
            f"{message} Fits with {', '.join(lost)} held did not converge before the end of the interval was reached: "
            "it is not known. Give more max_steps, or narrow the bounds to where the model can be evaluated."
        ).strip()
    return ProfileResult(found, level, search.critical, lowest if fell else None, message)


def _squares(objective: Objective, result: FitResult, variance: str) -> np.ndarray:
    """Variance that a rise of the cost is measured by, for each parameter."""
    values, curvature = _values(objective, jnp.asarray(result.scaled))
    cost = 0.5 * float(jnp.sum(values**2))
    if not abs(cost - result.cost) <= 1e-6 * max(cost, result.cost):
        raise InputError(
            f"This evidence gives the fit a cost of {cost:.6g}, but the fit had {result.cost:.6g}. Profile with the "
            "residual that was fitted."
        )
    plain = 1.0 if variance == "known" else 2 * result.cost / result.degrees_of_freedom
    if curvature is None:
        return np.full(len(result.scaled), plain)
    if variance == "known" or objective.constraints:
        raise InputError('Robust losses are profiled with variance="estimated" and without constraints only.')
    jacobian = np.asarray(linearised(objective, jnp.asarray(result.scaled))[0])
    weights = np.concatenate([np.asarray(curvature), np.ones(len(jacobian) - len(curvature))])  # priors at the end
    bent = np.diag(np.linalg.pinv(jacobian.T @ (jacobian * weights[:, None])))
    squares = np.diag(result.scaled_covariance) / bent
    return np.where(np.isfinite(squares) & (squares > 0), squares, plain)


@eqx.filter_jit
def _values(objective: Objective, vector: Array) -> tuple[Array, Array | None]:
    return objective(vector)


def _critical(level: float, freedom: int | None) -> float:
    from scipy import special

    tail = 0.5 + level / 2
    return float(special.ndtri(tail) if freedom is None else special.stdtrit(freedom, tail))


def _profile(search: ProfileSearch, path: str, index: int) -> Profile:
    space, best = search.result.space, search.result.scaled[index]
    shifts, ratio, vectors = search.points(index)
    parameter = space[path]

    def value(shift: float) -> float:
        return float(parameter.from_scaled(best + shift))

    sides = search.both(index)
    ends = [side.end(search.critical) for side in sides]
    reach = [value(s.sign * (s.room if end is None else end)) for s, end in zip(sides, ends, strict=True)]
    return Profile(
        path=path,
        unit=parameter.unit,
        estimate=float(search.result.values[index]),
        values=np.asarray([value(shift) for shift in shifts]),
        ratio=ratio,
        others=space.unscaled_rows(vectors),
        interval=(reach[0], reach[1]),
        open=(ends[0] is None, ends[1] is None),
    )
