"""What a derivative-based study returns."""

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sensitivity._tables import long_table, number_of, shown_html, shown_text
from twin.io.npz_file import NpzFile
from twin.parameters import ParameterSpace

if TYPE_CHECKING:
    import pandas as pd

_FILE = NpzFile(
    kind="derivative-based study",
    writer="DerivativeMeasures.save",
    version=1,
    arrays=("variance", "nu", "nu_conf", "bound", "bound_conf"),
    plain=("outputs", "n", "seed", "confidence"),
)


@dataclasses.dataclass(frozen=True, repr=False)
class DerivativeMeasures:
    """Mean squared derivatives of outputs, and what they say about total effects. Shows itself as a table."""

    space: ParameterSpace
    """The parameters, with their bounds."""
    outputs: tuple[str, ...]
    """Names of the outputs."""
    variance: np.ndarray
    """Variance V of each output [the output's unit squared], zero where nothing moves it (outputs,)."""
    nu: np.ndarray
    """ν_i·(b - a)²: mean squared derivative with respect to the parameter on its scale, as a share of its range [the
    output's unit squared] (outputs, parameters)."""
    nu_conf: np.ndarray
    """Half widths of its confidence intervals."""
    bound: np.ndarray
    """Upper bound ν_i·(b - a)²/(π²·V) of the total effect, zero where V is (outputs, parameters)."""
    bound_conf: np.ndarray
    """Half widths of its confidence intervals."""
    n: int
    """Points."""
    seed: int
    """Seed of points and intervals."""
    confidence: float
    """Probability that the intervals are made for."""

    @property
    def names(self) -> tuple[str, ...]:
        """Paths of the parameters."""
        return self.space.paths

    def index(self, output: str | int) -> int:
        """Number of an output.

        Args:
            output: its name, or its number.

        Raises:
            InputError: no such output.
        """
        return number_of(output, self.outputs)

    def to_dataframe(self) -> "pd.DataFrame":
        """Measures, bounds and half widths, one row per output and parameter."""
        columns = {name: getattr(self, name) for name in ("nu", "nu_conf", "bound", "bound_conf")}
        return long_table(self.outputs, self.names, columns)

    def save(self, path: str | Path) -> None:
        """Write the study to a file, without pickle.

        Args:
            path: file; the ending .npz is added if missing.
        """
        _FILE.write(path, self)

    @classmethod
    def load(cls, path: str | Path) -> "DerivativeMeasures":
        """Read what `save` wrote.

        Args:
            path: file; the ending .npz may be left out.

        Raises:
            InputError: file missing, damaged, of another kind or of another version.
        """
        found = _FILE.read(path)
        found["outputs"] = tuple(found["outputs"])
        return cls(**found)

    def _repr_html_(self) -> str:
        return shown_html(self.to_dataframe(), "Derivative-based measures", self._facts())

    def __repr__(self) -> str:
        return shown_text(self.to_dataframe(), "Derivative-based measures", self._facts())

    def _facts(self) -> str:
        return f"{self.n} points, seed {self.seed}, half widths at {100 * self.confidence:g} %"
