"""What sampling a posterior returns."""

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from twin._checks import InputError
from twin.io.npz_file import NpzFile
from twin.parameters import ParameterSpace

if TYPE_CHECKING:
    import pandas as pd

_FILE = NpzFile(
    kind="posterior",
    writer="Posterior.save",
    version=1,
    arrays=("values", "r_hat", "effective_size", "acceptance"),
    plain=("divergences", "evaluations", "data", "variance"),
)
_R_HAT, _EFFECTIVE = 1.01, 400.0


@dataclasses.dataclass(frozen=True, repr=False)
class Posterior:
    """Samples of a posterior, and whether they can be trusted. Shows itself as a table in a notebook."""

    space: ParameterSpace
    """The free parameters."""
    values: np.ndarray
    """Samples in SI (chains, samples, parameters)."""
    r_hat: np.ndarray
    """R̂ of each parameter, the larger of the rank-normalised and the folded split R̂ (Vehtari et al., Bayesian Analysis
    16 (2021) 667, section 4): spread over all chains over that within each half of a chain; near 1 where all have seen
    the same (parameters,)."""
    effective_size: np.ndarray
    """Bulk effective sample size of each parameter (ibid.): as many independent draws would say as much about its mean
    and median (parameters,)."""
    divergences: int
    """Draws whose trajectory diverged or met a failed simulation, after the warm-up."""
    acceptance: np.ndarray
    """Mean acceptance rate of each chain (chains,)."""
    evaluations: int
    """Evaluations of the model with its derivative, after the warm-up."""
    data: int
    """Number of residuals, priors not counted."""
    variance: str
    """"known" where the weights were taken to be exact; "estimated" where a common factor was integrated out."""

    @property
    def success(self) -> bool:
        """Whether R̂ is at most 1.01 and the bulk effective sample size at least 400 for all parameters, without any
        divergence."""
        return bool(np.all(self.r_hat <= _R_HAT) and np.all(self.effective_size >= _EFFECTIVE) and not self.divergences)

    @property
    def message(self) -> str:
        """What happened, and what to do about it."""
        if self.success:
            return "The chains agree, and there are enough draws."
        parts = []
        # Written so that NaN, of a chain that never moved, counts as bad.
        apart, few = ~(self.r_hat <= _R_HAT), ~(self.effective_size >= _EFFECTIVE)
        if apart.any():
            parts.append(
                f"The chains disagree (R̂ above {_R_HAT}) on {self.space.named(apart)}. Run more warm-up and samples; "
                "if it stays, there are several modes, or parameters that the data cannot tell apart: see plot_pairs."
            )
        if few.any():
            parts.append(
                f"Fewer than {_EFFECTIVE:g} effective draws of {self.space.named(few)}: quantiles are uncertain. Draw "
                "more samples."
            )
        if self.divergences:
            total = self.values.shape[0] * self.values.shape[1]
            parts.append(
                f"{self.divergences} of {total} draws diverged or met a failed simulation, so that a part of the "
                "posterior may be missing. Raise acceptance to 0.95 or 0.99, use a log scale or narrower bounds."
            )
        return " ".join(parts)

    @property
    def flat(self) -> np.ndarray:
        """Samples of all chains in SI (chains·samples, parameters)."""
        return self.values.reshape(-1, self.values.shape[-1])

    def intervals(self, level: float = 0.95) -> np.ndarray:
        """Central credible intervals in SI (parameters, 2), by quantiles.

        Args:
            level: probability of the intervals, between 0 and 1.

        Raises:
            InputError: level outside (0, 1).
        """
        if not 0 < level < 1:
            raise InputError(f"level must be between 0 and 1, but is {level}.")
        return np.quantile(self.flat, [0.5 - level / 2, 0.5 + level / 2], axis=0).T

    def __getitem__(self, path: str) -> np.ndarray:
        """Samples of one parameter in SI (chains, samples).

        Raises:
            InputError: a parameter that was not sampled.
        """
        if path not in self.space.paths:
            raise InputError(f"{path!r} was not sampled; these were: {', '.join(self.space.paths)}.")
        return self.values[:, :, self.space.paths.index(path)]

    def to_dataframe(self, level: float = 0.95) -> "pd.DataFrame":
        """Table of the marginals: unit, mean, standard deviation, quantiles, R̂, bulk effective sample size.

        Args:
            level: probability of the interval.
        """
        import pandas as pd

        low, high = self.intervals(level).T
        return pd.DataFrame(
            {
                "unit": self.space.units,
                "mean": self.flat.mean(axis=0),
                "standard deviation": self.flat.std(axis=0, ddof=1),
                f"{100 * level:g} % from": low,
                "median": np.median(self.flat, axis=0),
                f"{100 * level:g} % to": high,
                "R-hat": self.r_hat,
                "effective size": self.effective_size,
            },
            index=pd.Index(self.space.paths, name="parameter"),
        )

    def save(self, path: str | Path) -> None:
        """Save to one `.npz` file, without pickle.

        Args:
            path: file to write; the ending .npz is added if missing.
        """
        _FILE.write(path, self)

    @classmethod
    def load(cls, path: str | Path) -> "Posterior":
        """Load saved samples.

        Args:
            path: file written by `save`.

        Raises:
            InputError: file missing, damaged, not a saved posterior, or of another version.
        """
        return cls(**_FILE.read(path))

    def _repr_html_(self) -> str:
        table = self.to_dataframe().to_html(float_format=lambda x: f"{x:.6g}")
        return f"<div><p><b>Posterior</b>: {self._facts()}.</p><p>{self.message}</p>{table}</div>"

    def __repr__(self) -> str:
        return f"{self.to_dataframe().to_string(float_format=lambda x: f'{x:.6g}')}\n{self._facts()}. {self.message}"

    def _facts(self) -> str:
        chains, samples, _ = self.values.shape
        state = "usable" if self.success else "NOT to be trusted yet"
        return (
            f"{state}, {chains} chains of {samples} samples, {self.variance} variance, {self.divergences} divergences, "
            f"mean acceptance {np.mean(self.acceptance):.2f}"
        )
