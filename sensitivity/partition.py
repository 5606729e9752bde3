"""Which parameters to search for which output: a large identification problem cut into small ones."""

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from sensitivity._tables import number_of
from sensitivity.sobol_result import SobolIndices
from twin._checks import InputError

if TYPE_CHECKING:
    import pandas as pd

IN = "in"
OUT = "out"
UNDECIDED = "undecided"


@dataclasses.dataclass(frozen=True, repr=False)
class Partition:
    """For each output, which parameters matter, which do not, and which the study cannot tell. Shows itself as a table.

    The undecided ones are searched: a parameter too many costs time, one too few that is held at a wrong value bends
    all the others.
    """

    indices: SobolIndices
    """The study."""
    threshold: float
    """Total effect from which a parameter matters."""
    verdict: np.ndarray
    """"in", "out" or "undecided" (outputs, names)."""

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return self.indices.outputs

    @property
    def names(self) -> tuple[str, ...]:
        """Names of what was ranked: groups, or parameters where they stand alone."""
        return self.indices.names

    def searched(self, output: str | int) -> tuple[str, ...]:
        """Paths of the parameters to search for an output, those of its groups included, in the order of the space.

        Args:
            output: its name, or its number.

        Raises:
            InputError: no such output.
        """
        row = self.verdict[number_of(output, self.outputs)]
        kept = {name for name, verdict in zip(self.names, row, strict=True) if verdict != OUT}
        members = zip(self.indices.groups, self.indices.space.paths, strict=True)
        return tuple(path for group, path in members if group in kept)

    @property
    def searched_per_problem(self) -> dict[str, int]:
        """Number of parameters to search, by output."""
        return {output: len(self.searched(i)) for i, output in enumerate(self.outputs)}

    @property
    def never_searched(self) -> tuple[str, ...]:
        """Paths that matter for no output: these outputs cannot identify them."""
        found = {path for i in range(len(self.outputs)) for path in self.searched(i)}
        return tuple(path for path in self.indices.space.paths if path not in found)

    def to_dataframe(self) -> "pd.DataFrame":
        """Verdicts, one row per output and one column per parameter or group."""
        import pandas as pd

        return pd.DataFrame(self.verdict, index=pd.Index(self.outputs, name="output"), columns=list(self.names))

    def summary(self) -> "pd.DataFrame":
        """One row per output: how many parameters are searched, and the names in each class, strongest first."""
        import pandas as pd

        rows = [
            {"searched": len(self.searched(i)), IN: self._named(i, IN), UNDECIDED: self._named(i, UNDECIDED)}
            for i in range(len(self.outputs))
        ]
        return pd.DataFrame(rows, index=pd.Index(self.outputs, name="output"))

    def _repr_html_(self) -> str:
        return f"<div><p><b>Partition</b>: {self._facts()}</p>{self.summary().to_html(max_rows=60)}</div>"

    def __repr__(self) -> str:
        lines = []
        for i, output in enumerate(self.outputs):
            undecided = self._named(i, UNDECIDED)
            lines.append(f"{output}: {self._named(i, IN) or '-'}" + (f" (undecided: {undecided})" if undecided else ""))
        return "\n".join([*lines, f"Partition: {self._facts()}"])

    def _named(self, row: int, verdict: str) -> str:
        """Names of one class, strongest first."""
        order = np.argsort(-self.indices.ST[row], kind="stable")
        return ", ".join(self.names[k] for k in order if self.verdict[row, k] == verdict)

    def _facts(self) -> str:
        count = np.asarray(list(self.searched_per_problem.values()))
        facts = f"total effect above {100 * self.threshold:g} %; {count.min()} to {count.max()} of "
        facts += f"{len(self.indices.space)} parameters searched per output, undecided ones included."
        if self.never_searched:
            facts += f" No output sees {', '.join(self.never_searched)}."
        return facts


def partition(indices: SobolIndices, threshold: float = 0.01, *, interval: bool = True) -> Partition:
    """Sort parameters, for each output, by whether their total effect exceeds a threshold.

    In: the whole interval of S_T lies above the threshold. Out: it lies below. Undecided: it holds the threshold; a
    larger n decides. Undecided parameters are searched. The paper compares the estimate alone (`interval=False`).

    Args:
        indices: Sobol study.
        threshold: total effect from which a parameter matters; 0.01 in the paper.
        interval: take the interval into account.

    Returns:
        The verdicts.

    Raises:
        InputError: a threshold outside 0 to 1.

    References:
        J. Ellinger and M. F. Zaeh, Machines 10 (2022) 535, sections 2.3.1 and 3.2.
    """
    require_threshold(threshold)
    half = indices.ST_conf if interval else np.zeros_like(indices.ST_conf)
    above, below = indices.ST - half > threshold, indices.ST + half <= threshold
    return Partition(indices, threshold, np.where(above, IN, np.where(below, OUT, UNDECIDED)))


def require_threshold(threshold: float) -> None:
    """Raise unless a total effect can lie above and below.

    Args:
        threshold: total effect that matters [-].

    Raises:
        InputError: no share between 0 and 1.
    """
    if not 0 < threshold < 1:
        raise InputError(f"threshold must be between 0 and 1, but is {threshold}. 0.01 stands for 1 %.")
