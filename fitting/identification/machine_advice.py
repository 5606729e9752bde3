"""Which parameters of an identified machine are known too weakly, and which further measurement would help."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float
from threadpoolctl import threadpool_limits

from fitting.design import candidate_jacobian
from fitting.identifiability import IDENTIFIED
from fitting.identification.machine import MachineIdentification
from fitting.identification.machine_candidates import modes_at, usual_candidates
from fitting.residuals.residual import AbstractResidual
from fitting.result import FitResult
from fitting.uncertainty import covariance_of
from twin._checks import InputError, single_number

if TYPE_CHECKING:
    import pandas as pd

# A measurement that takes less than this share off a standard error is not worth a word.
_HELPS = 0.02


@dataclasses.dataclass(frozen=True, repr=False)
class MeasurementAdvice:
    """How well parameters are known now and after further measurements. Shows itself as a table in a notebook."""

    parameters: tuple[str, ...]
    """Paths of the parameters of the fit."""
    candidates: tuple[str, ...]
    """Names of the measurements that could be made."""
    limit: float
    """Relative standard error above which a parameter is known too weakly [-]."""
    known: Float[np.ndarray, "parameters"]
    """Relative standard error now [-]; infinite where a parameter is not seen."""
    predicted: Float[np.ndarray, "candidates parameters"]
    """The same after each of the measurements alone [-]."""
    on_bound: Bool[np.ndarray, "parameters"]
    """Which parameters sit on a bound; their standard errors are those that they would have without it."""
    determined: Bool[np.ndarray, "parameters"]
    """Which parameters the fit determines within their bounds, by `identifiability`."""

    @property
    def weak(self) -> tuple[str, ...]:
        """Parameters known too weakly, the least known first: a relative standard error above the limit, a bound, or a
        parameter that is not identified."""
        bad = self._weak
        return tuple(self.parameters[i] for i in np.argsort(-self.known, kind="stable") if bad[i])

    @property
    def best(self) -> dict[str, str]:
        """The measurement that helps each weak parameter most; left out where none helps."""
        return {path: self.candidates[ranked[0]] for path in self.weak if (ranked := self._ranked(path))}

    @property
    def message(self) -> str:
        """How many parameters are known well enough."""
        if not self.weak:
            return f"All {len(self.parameters)} parameters are known to {_percent(self.limit)} or better."
        return (
            f"{len(self.weak)} of {len(self.parameters)} parameters are known worse than to {_percent(self.limit)} or "
            "are not identified."
        )

    def sentences(self) -> tuple[str, ...]:
        """What to say about each weak parameter: how well it is known, and the two measurements that help it most."""
        return tuple(self._sentence(path) for path in self.weak)

    def to_dataframe(self) -> "pd.DataFrame":
        """Relative standard error of each parameter now and after each measurement, and which are weak."""
        import pandas as pd

        columns = {"weak": self._weak, "now": self.known, **dict(zip(self.candidates, self.predicted, strict=True))}
        return pd.DataFrame(columns, index=pd.Index(self.parameters, name="parameter"))

    @property
    def _weak(self) -> np.ndarray:
        return ~(self.known <= self.limit) | self.on_bound | ~self.determined

    def _ranked(self, path: str) -> list[int]:
        """Measurements that help a parameter, the best first."""
        i = self.parameters.index(path)
        after = self.predicted[:, i]
        order = np.argsort(after, kind="stable")
        return [int(k) for k in order if after[k] < (1 - _HELPS) * self.known[i]]

    def _sentence(self, path: str) -> str:
        i, ranked = self.parameters.index(path), self._ranked(path)
        now = f"is known to {_percent(self.known[i])} only" if np.isfinite(self.known[i]) else "is not seen"
        if self.on_bound[i]:
            now = "sits on a bound" + (f" and {now}" if self.known[i] > self.limit else "")
        elif self.known[i] <= self.limit:
            now = f"is not identified within its bounds, though known to {_percent(self.known[i])}"
        if not ranked:
            return f"{path} {now}; none of these measurements would help."
        gains = [f"{self.candidates[k]} would bring it to {_percent(self.predicted[k, i])}" for k in ranked[:1]]
        gains += [f"{self.candidates[k]} to {_percent(self.predicted[k, i])}" for k in ranked[1:2]]
        # What rounds to the limit is not said to miss it.
        least = self.predicted[ranked[0], i]
        enough = least <= self.limit or _percent(least) == _percent(self.limit)
        rest = "" if enough else f" None of them brings it to {_percent(self.limit)}."
        return f"{path} {now}; {', '.join(gains)}.{rest}"

    def _repr_html_(self) -> str:
        table = self.to_dataframe().to_html(float_format=lambda x: f"{x:.3g}")
        said = "".join(f"<li>{sentence}</li>" for sentence in self.sentences())
        return f"<div><p><b>Relative standard errors</b>: {self.message}</p><ul>{said}</ul>{table}</div>"

    def __repr__(self) -> str:
        table = self.to_dataframe().to_string(float_format=lambda x: f"{x:.3g}")
        return "\n".join([table, self.message, *self.sentences()])


def helpful_measurements(
    identification: MachineIdentification,
    positions: Sequence[float] = (),
    candidates: Mapping[str, AbstractResidual] | None = None,
    *,
    limit: float = 0.1,
) -> MeasurementAdvice:
    """Which parameters are known too weakly, and what each of some further measurements would bring.

    The standard errors to expect are those of linear theory: the information of the joint fit, with what is believed of
    uncertain quantities, and on top of it JᵀJ of the measurement (the inverse of Fisher's information; for instance G.
    A. F. Seber, C. J. Wild, Nonlinear Regression, 1989, section 2.1).

    Args:
        identification: an identified machine.
        positions: further axis positions [m] at which as many modes could be measured with the same precision.
        candidates: other measurements by name, each the residual that it would add: those of `machine_candidates`, or
            any other evidence about the machine. If not given: each kind of evidence five times, and half as many modes
            again.
        limit: relative standard error above which a parameter is known too weakly [-].

    Returns:
        The advice.

    Raises:
        InputError: a limit that is no share between 0 and 1, a position off a rail or measured already, no candidate at
            all, a fit or a candidate without a finite Jacobian.
    """
    single_number("limit", limit)
    if not 0 < limit < 1:
        raise InputError(f"limit must be a share between 0 and 1, such as 0.1 for 10 %, but is {limit}.")
    result = identification.fit
    if not np.all(np.isfinite(result.factor)):
        raise InputError("This fit has no finite Jacobian, so nothing can be predicted. " + result.message)
    others = {_at(z): modes_at(identification, _new(identification, float(z))) for z in positions}
    tried = {**others, **(usual_candidates(identification) if candidates is None else candidates)}
    if not tried:
        raise InputError(
            "There is no candidate. Give positions, or name candidates such as repeated(identification, 5)."
        )
    with threadpool_limits(1, user_api="blas"):
        known = result.factor / result.deviation
        after = [np.vstack([known, candidate_jacobian(result, name, tried[name])]) for name in tried]
        errors = [_relative_errors(result, rows) for rows in (known, *after)]
    return MeasurementAdvice(
        parameters=result.space.paths,
        candidates=tuple(tried),
        limit=float(limit),
        known=errors[0],
        predicted=np.stack(errors[1:]),
        on_bound=np.asarray(result.active),
        determined=np.asarray([v.kind == IDENTIFIED for v in identification.seen.verdicts]),
    )


def _new(identification: MachineIdentification, position: float) -> float:
    measured = np.asarray(identification.evidence.position)
    if np.any(np.abs(measured - position) < 1e-9):
        raise InputError(
            f"The modes at position {position:g} m are measured already. Name repeated(identification, 2) a candidate."
        )
    return position


def _at(position: float) -> str:
    return f"modes at z = {float(position):.4g} m"


def _relative_errors(result: FitResult, rows: np.ndarray) -> np.ndarray:
    """Relative standard errors of weighted rows of a Jacobian in the scaled vector, bounds left out of account."""
    nowhere = np.zeros(rows.shape[1], dtype=bool)
    covariance = covariance_of(np.zeros(len(rows)), rows, nowhere, variance="known")
    slopes = np.asarray(result.space.slopes(jnp.asarray(result.values)))
    relative = np.sqrt(np.diag(covariance.matrix)) * np.abs(slopes / result.values)
    return np.where(covariance.unseen, np.inf, relative)


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %" if share < 0.995 else f"{100 * share:.0f} %"
