"""What a fit returns."""

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from fitting.solvers.stop import CONVERGED, Stop
from twin._checks import InputError
from twin.io.npz_file import NpzFile
from twin.parameters import ParameterSpace

if TYPE_CHECKING:
    import pandas as pd

_FILE = NpzFile(
    kind="fit result",
    writer="FitResult.save",
    version=2,
    arrays=("values", "scaled", "scaled_covariance", "factor", "unseen", "active", "residual", "cost_history"),
    plain=("condition_number", "degrees_of_freedom", "steps", "stop", "offset", "variance", "correlated", "warning"),
)


class Estimate(NamedTuple):
    """One estimated parameter."""

    value: float
    """Estimate, SI."""
    standard_error: float
    """Standard error; NaN where the parameter sits on a bound or is not seen by the data."""
    unit: str
    """Unit."""


@dataclasses.dataclass(frozen=True, repr=False)
class FitResult:
    """A fitted model, with what is known about its parameters. Shows itself as a table in a notebook."""

    model: Any
    """The fitted model."""
    space: ParameterSpace
    """The free parameters."""
    values: np.ndarray
    """Estimates in SI (parameters,)."""
    scaled: np.ndarray
    """Estimates as the solver's scaled vector (parameters,)."""
    scaled_covariance: np.ndarray
    """Covariance of the scaled vector (parameters, parameters)."""
    factor: np.ndarray
    """Upper triangular R with RᵀR = JᵀJ, the information on the scaled vector that data and priors hold (parameters,
    parameters)."""
    condition_number: float
    """Condition of the column-normalised Jacobian; above some 1e4 parameters trade places with each other."""
    degrees_of_freedom: int
    """Residuals minus freely moving parameters."""
    unseen: np.ndarray
    """Which parameters the data do not see (parameters,)."""
    active: np.ndarray
    """Which parameters sit on a bound that holds them back (parameters,)."""
    residual: np.ndarray
    """Weighted residual at the end (residuals,); NaN where it is not finite at the start."""
    cost_history: np.ndarray
    """Half the sum of squared residuals, before and after each step."""
    steps: int
    """Steps taken."""
    stop: str
    """Name of the reason for stopping, one of `Stop`."""
    offset: float
    """Relative offset at the end: how much of the residual the linear model could still remove."""
    variance: str = "estimated"
    """"estimated" from the residual, or "known" where the weights were taken to be exact."""
    correlated: bool = False
    """Whether the covariance allows for errors that hang together from sample to sample."""
    warning: str = ""
    """What else the procedure has to say about this fit."""

    @property
    def success(self) -> bool:
        """Whether the fit converged."""
        return self.stop in CONVERGED

    @property
    def message(self) -> str:
        """What happened, and what to do about it."""
        parts = [str(Stop[getattr(Stop, self.stop)])]
        if not self.success and np.isfinite(np.diag(self.scaled_covariance)).any():
            parts.append("Standard errors and intervals hold only at a converged fit.")
        if self.active.any():
            parts.append(
                f"On a bound: {self.space.named(self.active)}; their standard errors are not given. "
                "Widen the bounds if they are not physical."
            )
        if self.unseen.any():
            parts.append(
                f"Not determined by these data: {self.space.named(self.unseen)}. Hold some fixed, give priors, or "
                "measure something that sees them."
            )
        elif self.success and np.isnan(np.diag(self.scaled_covariance))[~self.active].any():
            parts.append(
                "There are no standard errors: no data are left over to estimate a variance from, or the point is no "
                "minimum of the robust loss (start that from a Huber fit)."
            )
        elif self.condition_number > 1e6:
            parts.append(
                f"The condition number {self.condition_number:.1e} is high: some parameters trade places with each "
                "other; look at the correlation."
            )
        return " ".join([*parts, self.warning]).strip()

    @property
    def cost(self) -> float:
        """Half the sum of squared residuals; NaN where they are not finite at the start."""
        return 0.5 * float(self.residual @ self.residual)

    @property
    def rms(self) -> float:
        """Root mean square of the weighted residual; near 1 where the model fits and the weights are right [-]."""
        return float(np.sqrt(2 * self.cost / max(self.degrees_of_freedom, 1)))

    @property
    def deviation(self) -> float:
        """Standard deviation of the weighted residual that uncertainties go by: 1 where the weights are exact, else its
        rms [-]."""
        return 1.0 if self.variance == "known" else self.rms

    @property
    def covariance(self) -> np.ndarray:
        """Covariance of the estimates in SI (parameters, parameters)."""
        slopes = np.asarray(self.space.slopes(jnp.asarray(self.values)))
        return self.scaled_covariance * np.outer(slopes, slopes)

    @property
    def standard_errors(self) -> np.ndarray:
        """Standard errors in SI (parameters,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> np.ndarray:
        """Correlation of the estimates (parameters, parameters)."""
        error = np.sqrt(np.diag(self.scaled_covariance))
        sizes = np.outer(error, error)
        # What a constraint fixes has no variance, and no correlation.
        return np.divide(self.scaled_covariance, sizes, out=np.full_like(sizes, np.nan), where=sizes > 0)

    def intervals(self, level: float = 0.95) -> np.ndarray:
        """Confidence intervals in SI (parameters, 2), by Student's t on the scale of each parameter.

        On a log scale the interval is therefore unsymmetric and stays positive; on a linear one it may reach beyond the
        bounds. NaN where a parameter sits on a bound or is not seen.

        Args:
            level: confidence, between 0 and 1.

        Raises:
            InputError: level outside (0, 1).
        """
        if not 0 < level < 1:
            raise InputError(f"level must be between 0 and 1, but is {level}.")
        freedom = np.inf if self.variance == "known" else self.degrees_of_freedom
        if freedom < 1:
            return np.full((len(self.space), 2), np.nan)
        from scipy import special  # half a second to import, the quantiles of scipy.stats two

        reach = special.stdtrit(freedom, 0.5 + level / 2) * np.sqrt(np.diag(self.scaled_covariance))
        ends = [np.asarray(self.space.unscaled(jnp.asarray(self.scaled + side * reach))) for side in (-1, 1)]
        return np.stack(ends, axis=1)

    def __getitem__(self, path: str) -> Estimate:
        if path not in self.space.paths:
            raise InputError(f"{path!r} was not fitted; fitted were {', '.join(self.space.paths)}.")
        i = self.space.paths.index(path)
        return Estimate(float(self.values[i]), float(self.standard_errors[i]), self.space.units[i])

    def estimates(self) -> dict[str, Estimate]:
        """All estimates by path."""
        return {path: self[path] for path in self.space.paths}

    def to_dataframe(self, level: float = 0.95) -> "pd.DataFrame":
        """Table of the estimates: unit, value, standard error, interval, bounds, remark.

        Args:
            level: confidence of the intervals.
        """
        import pandas as pd

        low, high = self.intervals(level).T
        return pd.DataFrame(
            {
                "unit": self.space.units,
                "estimate": self.values,
                "standard error": self.standard_errors,
                f"{100 * level:g} % from": low,
                f"{100 * level:g} % to": high,
                "lower bound": [p.lower for p in self.space.parameters],
                "upper bound": [p.upper for p in self.space.parameters],
                "remark": [self._remark(i) for i in range(len(self.space))],
            },
            index=pd.Index(self.space.paths, name="parameter"),
        )

    def save(self, path: str | Path) -> None:
        """Save everything but the model's structure to one `.npz` file, without pickle.

        Args:
            path: file to write; the ending .npz is added if missing.
        """
        _FILE.write(path, self)

    @classmethod
    def load(cls, path: str | Path, model: Any) -> "FitResult":
        """Load a saved result.

        Args:
            path: file written by `save`.
            model: a model of the structure that was fitted; its free parameters are set to the estimates.

        Returns:
            The result, equal to the one saved.

        Raises:
            InputError: file missing, damaged or not a saved result; model without the parameters.
        """
        saved = _FILE.read(path)
        return cls(model=saved["space"].with_values(model, jnp.asarray(saved["values"])), **saved)

    def _repr_html_(self) -> str:
        table = self.to_dataframe().to_html(float_format=lambda x: f"{x:.6g}")
        return f"<div><p><b>Fit</b>: {self._facts()}.</p><p>{self.message}</p>{table}</div>"

    def __repr__(self) -> str:
        table = self.to_dataframe().to_string(float_format=lambda x: f"{x:.6g}")
        return f"{table}\nFit: {self._facts()}. {self.message}"

    def _facts(self) -> str:
        state = "converged" if self.success else "NOT converged"
        rms = f"{self.rms:.4g} rms" if np.isfinite(self.rms) else "not evaluated"
        return (
            f"{state} in {self.steps} steps, weighted residual {rms}, {self.degrees_of_freedom} degrees of freedom, "
            f"condition number {self.condition_number:.3g}"
        )

    def _remark(self, i: int) -> str:
        if self.active[i]:
            return "at a bound"
        return "not determined" if self.unseen[i] else ""
