"""Which measurement would help: the information that candidate experiments would add to what is known."""

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array

from fitting.identifiability import plausible_range
from fitting.objective import Objective
from fitting.residuals.residual import AbstractResidual
from fitting.result import FitResult
from fitting.solve import linearised
from fitting.solvers.slsqp import SLSQP
from twin._checks import InputError
from twin.parameters import ParameterSpace

if TYPE_CHECKING:
    import pandas as pd


@dataclasses.dataclass(frozen=True, repr=False)
class ExperimentRanking:
    """What candidate experiments would add. Shows itself as a table in a notebook."""

    names: tuple[str, ...]
    """The candidates."""
    gains: np.ndarray
    """Rise of ln det of the information by doing each candidate once (candidates,)."""
    effort: np.ndarray
    """D-optimal shares of effort among the candidates, summing to one (candidates,)."""
    sensitivity: np.ndarray
    """Derivative of ln det along each candidate at the optimum; none exceeds `bound` (equivalence theorem)."""
    bound: float
    """What the candidates that get effort have in common at the optimum."""
    standard_errors: np.ndarray
    """Standard errors after doing each candidate once, SI (candidates, parameters)."""
    space: ParameterSpace
    """The parameters."""

    @property
    def best(self) -> str:
        """The candidate that adds most."""
        return self.names[int(np.argmax(self.gains))]

    def to_dataframe(self) -> "pd.DataFrame":
        """Table of the candidates: gain, share of effort, standard errors to expect."""
        import pandas as pd

        table = pd.DataFrame({"gain of ln det": self.gains, "share of effort": self.effort}, index=list(self.names))
        for parameter, errors in zip(self.space.parameters, self.standard_errors.T, strict=True):
            table[f"s.e. of {parameter.label}"] = errors
        table.index.name = "experiment"
        return table

    def _repr_html_(self) -> str:
        return self.to_dataframe().to_html(float_format=lambda x: f"{x:.4g}")

    def __repr__(self) -> str:
        return self.to_dataframe().to_string(float_format=lambda x: f"{x:.4g}")


def rank_experiments(result: FitResult, candidates: Mapping[str, AbstractResidual]) -> ExperimentRanking:
    """Rank candidate experiments by D-optimality at a fit, and share effort among them.

    A candidate is the residual that it would give: built like any other, with the standard deviations to expect; its
    measured values do not matter. The information on top of the fit's own, M₀ + Σwᵢ·JᵢᵀJᵢ, is maximised in ln det over
    the shares w ≥ 0, Σw = 1, by gradient (the problem is convex). Where the fit leaves a parameter open, its bounds
    stand in as weak knowledge: a normal distribution as wide as them.

    Args:
        result: the fit so far.
        candidates: residual by name.

    Returns:
        The ranking.

    Raises:
        InputError: no candidate, or one whose Jacobian is not finite at the fit.
    """
    if not candidates:
        raise InputError("Name at least one candidate experiment.")
    space = result.space
    rows = {name: candidate_jacobian(result, name, residual) for name, residual in candidates.items()}
    information = [jacobian.T @ jacobian for jacobian in rows.values()]
    known = result.factor.T @ result.factor / result.deviation**2 if np.all(np.isfinite(result.factor)) else 0.0
    known = known + np.diag(
        [1 / plausible_range(p, x) ** 2 for p, x in zip(space.parameters, result.scaled, strict=True)]
    )
    base = np.linalg.slogdet(known)[1]
    gains = np.asarray([np.linalg.slogdet(known + m)[1] - base for m in information])
    spreads = np.asarray([np.sqrt(np.diag(np.linalg.inv(known + m))) for m in information])
    effort = _optimal_effort(known, np.stack(information))
    total = known + np.tensordot(effort, information, 1)
    along = np.asarray([np.trace(np.linalg.solve(total, m)) for m in information])
    return ExperimentRanking(
        names=tuple(candidates),
        gains=gains,
        effort=effort,
        sensitivity=along,
        bound=float(effort @ along),
        standard_errors=spreads * np.abs(np.asarray(space.slopes(jnp.asarray(result.values)))),
        space=space,
    )


def candidate_jacobian(result: FitResult, name: str, residual: AbstractResidual) -> np.ndarray:
    """Jacobian of a candidate experiment in the scaled vector, at a fit: what it would add is JᵀJ.

    Args:
        result: the fit so far.
        name: of the candidate, for messages.
        residual: what it would give.

    Returns:
        The Jacobian (residuals, parameters).

    Raises:
        InputError: a Jacobian that is not finite.
    """
    jacobian, _ = linearised(Objective(residual, result.model, result.space), jnp.asarray(result.scaled))
    priors = sum(p.prior is not None for p in result.space.parameters)
    rows = np.asarray(jacobian)[: len(jacobian) - priors]
    if not np.all(np.isfinite(rows)):
        raise InputError(f"Candidate {name!r} has no finite Jacobian at the fit. Simulate it with the fitted model.")
    return rows


def _optimal_effort(known: np.ndarray, information: np.ndarray) -> np.ndarray:
    """Shares that maximise ln det(M₀ + Σw·M)."""
    count = len(information)
    if count == 1:
        return np.ones(1)
    # In units of the total, so that the determinant stays near one.
    size = np.sqrt(np.diag(known + information.mean(axis=0)))
    scaled, base = information / np.outer(size, size), known / np.outer(size, size)

    def cost(w: Array, args: tuple[Array, Array]) -> Array:
        return -jnp.linalg.slogdet(args[1] + jnp.tensordot(w, args[0], 1))[1]

    options = {
        "lower": jnp.zeros(count),
        "upper": jnp.ones(count),
        "equality": lambda w, args: jnp.sum(w)[None] - 1,
        "autodiff_mode": "rev",
    }
    solution = optx.minimise(
        cost,
        SLSQP(rtol=1e-12),
        jnp.full(count, 1 / count),
        args=(jnp.asarray(scaled), jnp.asarray(base)),
        options=options,
        max_steps=500,
        throw=False,
    )
    return np.asarray(solution.value)
