"""What a Sobol study returns: indices of all outputs, with intervals, at several sample sizes."""

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sensitivity._tables import long_table, number_of, shown_html, shown_text
from twin._checks import InputError
from twin.io.npz_file import NpzFile
from twin.parameters import ParameterSpace

if TYPE_CHECKING:
    import pandas as pd

_FILE = NpzFile(
    kind="Sobol study",
    writer="SobolIndices.save",
    version=1,
    arrays=("variance", "sizes", "S1_by_size", "S1_conf_by_size", "ST_by_size", "ST_conf_by_size", "S2", "S2_conf"),
    plain=("groups", "outputs", "seed", "confidence", "resamples"),
)


@dataclasses.dataclass(frozen=True, repr=False)
class SobolIndices:
    """Shares of each output's variance that its parameters cause. Shows itself as a table in a notebook."""

    space: ParameterSpace
    """The parameters, with the bounds that the variance is taken between."""
    groups: tuple[str, ...]
    """Name of the group of each parameter; its own path where it stands alone (parameters,)."""
    outputs: tuple[str, ...]
    """Names of the outputs."""
    variance: np.ndarray
    """Variance of each output [the output's unit squared], zero where nothing moves it: all its indices are then zero
    (outputs,)."""
    sizes: np.ndarray
    """Base points used for each estimate, the first n/8, n/4, n/2 and all n of the same run (sizes,)."""
    S1_by_size: np.ndarray
    """First-order indices for these sizes (sizes, outputs, names)."""
    S1_conf_by_size: np.ndarray
    """Half widths of their confidence intervals."""
    ST_by_size: np.ndarray
    """Total-effect indices for these sizes (sizes, outputs, names)."""
    ST_conf_by_size: np.ndarray
    """Half widths of their confidence intervals."""
    S2: np.ndarray
    """Second-order indices (outputs, names, names), above the diagonal, NaN elsewhere; (outputs, 0, 0) if not asked
    for."""
    S2_conf: np.ndarray
    """Half widths of their confidence intervals."""
    seed: int
    """Seed of samples and intervals."""
    confidence: float
    """Probability that the intervals are made for."""
    resamples: int
    """Bootstrap samples that the intervals come from."""

    @property
    def n(self) -> int:
        """Base points."""
        return int(self.sizes[-1])

    @property
    def names(self) -> tuple[str, ...]:
        """Names of what is ranked: groups, or parameters where they stand alone."""
        return tuple(dict.fromkeys(self.groups))

    @property
    def units(self) -> tuple[str, ...]:
        """Units of what is ranked; empty for groups."""
        units = dict(zip(self.space.paths, self.space.units, strict=True))
        return tuple(units.get(name, "") for name in self.names)

    @property
    def S1(self) -> np.ndarray:
        """First-order indices S_i: the share of the variance that goes if the parameter were known (outputs, names)."""
        return self.S1_by_size[-1]

    @property
    def S1_conf(self) -> np.ndarray:
        """Half widths of their confidence intervals (outputs, names)."""
        return self.S1_conf_by_size[-1]

    @property
    def ST(self) -> np.ndarray:
        """Total-effect indices S_Ti: the share that stays if all others were known (outputs, names)."""
        return self.ST_by_size[-1]

    @property
    def ST_conf(self) -> np.ndarray:
        """Half widths of their confidence intervals (outputs, names)."""
        return self.ST_conf_by_size[-1]

    def index(self, output: str | int) -> int:
        """Number of an output.

        Args:
            output: its name, or its number.

        Raises:
            InputError: no such output.
        """
        return number_of(output, self.outputs)

    def at(self, size: int) -> "SobolIndices":
        """The study as it stood after the first base points, without second-order indices.

        Args:
            size: one of `sizes`.

        Raises:
            InputError: another size.
        """
        if size not in self.sizes:
            raise InputError(f"There is no estimate at {size} base points, only at {', '.join(map(str, self.sizes))}.")
        kept = slice(0, int(np.flatnonzero(self.sizes == size)[0]) + 1)
        by_size = {name: getattr(self, name)[kept] for name in _FILE.arrays if name.endswith("size")}
        empty = np.zeros((len(self.outputs), 0, 0))
        return dataclasses.replace(self, sizes=self.sizes[kept], S2=empty, S2_conf=empty, **by_size)

    def to_dataframe(self) -> "pd.DataFrame":
        """Indices and half widths, one row per output and parameter."""
        columns = {name: getattr(self, name) for name in ("S1", "S1_conf", "ST", "ST_conf")}
        return long_table(self.outputs, self.names, columns)

    def second_order_dataframe(self) -> "pd.DataFrame":
        """Second-order indices and half widths, one row per output and pair of parameters.

        Raises:
            InputError: they were not asked for.
        """
        import pandas as pd

        if not self.S2.size:
            raise InputError("There are no second-order indices. Ask for them by sobol(..., second_order=True).")
        j, k = np.triu_indices(len(self.names), 1)
        pairs = [(o, self.names[a], self.names[b]) for o in self.outputs for a, b in zip(j, k, strict=True)]
        rows = pd.MultiIndex.from_tuples(pairs, names=["output", "parameter", "with"])
        return pd.DataFrame({"S2": self.S2[:, j, k].ravel(), "S2_conf": self.S2_conf[:, j, k].ravel()}, index=rows)

    def save(self, path: str | Path) -> None:
        """Write the study to a file, without pickle.

        Args:
            path: file; the ending .npz is added if missing.
        """
        _FILE.write(path, self)

    @classmethod
    def load(cls, path: str | Path) -> "SobolIndices":
        """Read what `save` wrote.

        Args:
            path: file; the ending .npz may be left out.

        Raises:
            InputError: file missing, damaged, of another kind or of another version.
        """
        found = _FILE.read(path)
        for name in ("groups", "outputs"):
            found[name] = tuple(found[name])
        return cls(**found)

    def _repr_html_(self) -> str:
        return shown_html(self.to_dataframe(), "Sobol indices", self._facts())

    def __repr__(self) -> str:
        return shown_text(self.to_dataframe(), "Sobol indices", self._facts())

    def _facts(self) -> str:
        still = int(np.sum(self.variance == 0))
        facts = f"{len(self.outputs)} outputs, {len(self.names)} parameters or groups, n = {self.n}, seed {self.seed}, "
        facts += f"half widths at {100 * self.confidence:g} %"
        return facts + (f"; {still} of the outputs do not vary" if still else "")
