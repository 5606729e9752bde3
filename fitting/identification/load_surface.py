"""Load-dependent stiffness and damping of each drive train from the totals of both (Leipe et al., section V)."""

import dataclasses
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float
from scipy.optimize import nnls

from fitting.fit import fit
from fitting.residuals.load_surface import LoadSurfaceResidual, total_over_contacts
from fitting.result import FitResult
from twin._checks import InputError
from twin.laws import AbstractLoadLaw, HyperbolicDamping, RootStiffness
from twin.parameters import Parameter, ParameterSpace


@dataclasses.dataclass(frozen=True)
class LoadSurfaceFit:
    """A load law fitted to totals over two drive trains."""

    result: FitResult
    """The fit, with standard errors and intervals; its model is the law."""
    error_percent: float
    """Remaining error 100·√(eᵀe / mᵀm) of the totals (eq. 5a) [%]."""

    @property
    def law(self) -> Any:
        """The law of one drive train: what it has when the other carries nothing is what the law says."""
        return self.result.model

    def surface(self, forces: Float[ArrayLike, "contacts *batch"]) -> Float[Array, "*batch"]:
        """Total at any forces, as eq. 4 and 9.

        Args:
            forces: force through each drive train, along the first axis [N].
        """
        return total_over_contacts(self.law, forces)


def remaining_error(
    law: AbstractLoadLaw, forces: Float[ArrayLike, "contacts points"], measured: Float[ArrayLike, "points"]
) -> float:
    """100·√(eᵀe / mᵀm) of the totals of a law (eq. 5a, 5b) [%].

    Args:
        law: the law.
        forces: force through each drive train [N].
        measured: measured totals m.

    Raises:
        InputError: if all totals are zero.
    """
    m = np.asarray(measured, dtype=float)
    if not np.any(m):
        raise InputError("All measured totals are zero: there is nothing that the error could be relative to.")
    e = m - np.asarray(total_over_contacts(law, forces))  # eq. 5b
    return float(100 * np.sqrt((e @ e) / (m @ m)))


def fit_root_stiffness(
    forces: Float[ArrayLike, "contacts _"],
    stiffness: Float[ArrayLike, "_"],
    *,
    deviation: float | None = None,
    width: float = 1.0,
) -> LoadSurfaceFit:
    """k1 and k2 of eq. 3 from total stiffnesses (eq. 4), as eq. 5, but by gradients and with error bars.

    Args:
        forces: motor forces of each drive train [N].
        stiffness: total stiffness measured at each point [N/m].
        deviation: standard deviation of the totals [N/m]; from the scatter about the fit if not given.
        width: force over which the law is smoothed [N].

    Returns:
        The fit.

    Raises:
        InputError: fewer than two points, shapes that do not match, values not finite, totals not positive.
    """
    residual = _residual(forces, stiffness, deviation)
    # Where both forces are alike, ln(total/contacts) is a straight line over ln|F|.
    force = np.maximum(np.mean(np.abs(np.asarray(residual.forces)), axis=0), width)
    total = np.asarray(residual.measured) / len(residual.forces)
    if np.any(total <= 0):
        raise InputError("A measured total stiffness is not positive. Leave such points out: their peak was misread.")
    slope, intercept = np.polyfit(np.log(force), np.log(total), 1) if np.ptp(force) > 0 else (0.2, np.log(total[0]))
    start = RootStiffness(np.exp(intercept), 1 / np.clip(slope, 0.01, 2.0), width)
    space = ParameterSpace(
        [Parameter("k1", "N/m", lower=0.0, scale="log"), Parameter("k2", "1", lower=0.0, scale="log")]
    )
    return _fit(residual, start, space, deviation)


def fit_hyperbolic_damping(
    forces: Float[ArrayLike, "contacts _"],
    damping: Float[ArrayLike, "_"],
    *,
    deviation: float | None = None,
    width: float = 1.0,
) -> LoadSurfaceFit:
    """d1, d2 and d3 of eq. 8 from total dampings (eq. 9).

    Args:
        forces: motor forces of each drive train [N].
        damping: total damping measured at each point [Ns/m].
        deviation: standard deviation of the totals [Ns/m]; from the scatter about the fit if not given.
        width: force over which the law is smoothed [N].

    Returns:
        The fit.

    Raises:
        InputError: fewer than three points, shapes that do not match, values not finite.
    """
    residual = _residual(forces, damping, deviation)
    typical = max(float(np.mean(np.abs(residual.measured))), 1e-12)
    start = _start_hyperbola(np.asarray(residual.forces), np.asarray(residual.measured), width)
    space = ParameterSpace(
        [
            Parameter("d1", "N²s/m", lower=0.0, scale="log"),
            Parameter("d2", "N", lower=0.0, scale="log"),
            # A round number, so that fits to similar data share one compiled program.
            Parameter("d3", "Ns/m", lower=0.0, size=10.0 ** round(np.log10(typical))),
        ]
    )
    return _fit(residual, start, space, deviation)


def _residual(forces: ArrayLike, measured: ArrayLike, deviation: float | None) -> LoadSurfaceResidual:
    measured = np.asarray(measured, dtype=float)
    # Any common size will do where the scatter itself tells the variance.
    size = float(np.sqrt(np.mean(measured**2))) if deviation is None else deviation
    return LoadSurfaceResidual(forces, measured, size if size > 0 else 1.0)


def _start_hyperbola(forces: np.ndarray, totals: np.ndarray, width: float) -> HyperbolicDamping:
    """The best of a few d2: the other two are then a linear problem."""
    magnitude = np.sqrt(forces**2 + width**2)
    best = (np.inf, None)
    for d2 in np.geomspace(0.02, 5.0, 9) * max(float(np.mean(magnitude)), width):
        columns = np.stack([np.sum(1 / (d2 + magnitude), axis=0), np.full(totals.size, float(len(forces)))], axis=1)
        scale = np.linalg.norm(columns, axis=0)
        found, misfit = nnls(columns / scale, totals)
        if misfit < best[0]:
            best = (misfit, (found[0] / scale[0], d2, found[1] / scale[1]))
    d1, d2, d3 = best[1] if best[1] is not None else (0.0, 1.0, 0.0)
    # On a log scale a coefficient cannot start from zero.
    least = 1e-3 * float(np.mean(np.abs(totals))) * d2
    return HyperbolicDamping(max(d1, least), d2, d3, width)


def _fit(
    residual: LoadSurfaceResidual, start: AbstractLoadLaw, space: ParameterSpace, deviation: float | None
) -> LoadSurfaceFit:
    result = fit(residual, start, space, variance="estimated" if deviation is None else "known")
    return LoadSurfaceFit(result, remaining_error(result.model, jnp.asarray(residual.forces), residual.measured))
