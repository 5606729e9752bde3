"""The control by data that were held back: does the fit predict what it has not seen?"""

from typing import Any, NamedTuple

import equinox as eqx
import numpy as np

from fitting.controls.relative_error import relative_errors
from fitting.controls.split import hold_back
from fitting.fit import fit
from fitting.residuals.residual import AbstractResidual, Piece, pieces
from twin._checks import InputError
from twin.parameters import ParameterSpace


class HeldBack(NamedTuple):
    """How well a fit predicts data that it has not seen."""

    name: str
    """Name of the control."""
    fitted_rms: float
    """Root mean square of the weighted residual of the fitted data [-]."""
    rms: float
    """The same of the data held back [-]."""
    limit: float
    """Ratio up to which the control passes [-]."""
    fitted_errors: dict[str, float]
    """Relative error of the fitted data by channel or response [-]."""
    errors: dict[str, float]
    """Relative error of the data held back [-]."""

    @property
    def ratio(self) -> float:
        """By how much the data held back are described worse than the fitted ones [-]."""
        return _ratio(self.rms, self.fitted_rms)

    @property
    def passed(self) -> bool:
        """Whether the fit predicts data that it has not seen about as well as it describes those it has."""
        return bool(self.ratio <= self.limit)

    @property
    def sentence(self) -> str:
        """The result in words."""
        errors = ", ".join(
            f"{name} {100 * value:.3g} % (fitted {100 * self.fitted_errors[name]:.3g} %)"
            for name, value in self.errors.items()
            if name in self.fitted_errors
        )
        size = f"the weighted residual is {short(self.rms)} there and {short(self.fitted_rms)} on the fitted data"
        relative = f"; relative errors: {errors}" if errors else ""
        if self.passed:
            return f"Data that were held back are predicted about as well as the fitted ones: {size}{relative}."
        return (
            f"Data that were held back are predicted {short(self.ratio)} times worse than the fitted ones: {size}"
            f"{relative}. The model has too much freedom, or the data held back show what it lacks. Free fewer "
            "parameters, or fit data that cover the same speeds, positions and loads."
        )


def held_back(
    fitted: AbstractResidual,
    kept: AbstractResidual,
    model: Any,
    *,
    limit: float = 2.0,
    name: str = "held back",
) -> HeldBack:
    """Predict data that were not fitted, and compare the error with that of the fitted data.

    The verdict goes by the weighted residual, which counts errors in units of the noise: a relative error rises with
    every record whose signal is smaller. Rows of no weight do not count.

    Args:
        fitted: evidence that was fitted.
        kept: evidence that was not: another record, or what `hold_back` keeps.
        model: the fitted model.
        limit: ratio of the two up to which the control passes, above 1.
        name: name of the control.

    Raises:
        InputError: a limit of 1 or below, evidence that refuses the model.
    """
    if not limit > 1:
        raise InputError(f"limit must be above 1, but is {limit}.")
    return HeldBack(
        name,
        rms_of(fitted, model),
        rms_of(kept, model),
        limit,
        relative_errors(fitted, model),
        relative_errors(kept, model),
    )


def held_back_share(
    evidence: AbstractResidual,
    model: Any,
    space: ParameterSpace,
    *,
    share: float = 0.25,
    limit: float = 2.0,
    max_steps: int = 100,
) -> HeldBack:
    """Fit without the last share of each record, or some lines of each response, and predict these.

    Args:
        evidence: all evidence, as in `hold_back`.
        model: start of the fit; best the result of the fit to all data.
        space: free parameters.
        share: as in `hold_back`.
        limit: as in `held_back`.
        max_steps: as in `fitting.fit.fit`.

    Raises:
        InputError: as `hold_back` and `fitting.fit.fit`.
    """
    parts = hold_back(evidence, share=share)
    result = fit(parts.fitted, model, space, max_steps=max_steps)
    return held_back(parts.fitted, parts.kept, result.model, limit=limit, name=f"{100 * share:.3g} % held back")


def short(value: float) -> str:
    """A number for a sentence, with three digits.

    Args:
        value: the number.
    """
    return f"{value:.3g}" if not 1e3 <= abs(value) < 1e9 else f"{value:.0f}"


def rms_of(evidence: AbstractResidual, model: Any) -> float:
    """Root mean square of the weighted residual, without robust losses; rows of no weight do not count [-].

    Args:
        evidence: evidence.
        model: the model.

    Returns:
        The root mean square; infinite where the residual is not finite.
    """
    values = np.concatenate([np.asarray(piece.plain) for piece in _pieces(evidence, model)])
    if not np.all(np.isfinite(values)):
        return float("inf")
    return float(np.linalg.norm(values) / np.sqrt(max(np.count_nonzero(values), 1)))


@eqx.filter_jit
def _pieces(evidence: AbstractResidual, model: Any) -> tuple[Piece, ...]:
    return pieces(evidence, model)


def _ratio(value: float, reference: float) -> float:
    if reference == 0:
        return 1.0 if value == 0 else float("inf")
    return value / reference if np.isfinite(reference) else float("nan")
