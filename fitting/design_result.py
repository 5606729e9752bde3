"""What a design returns."""

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting.solvers.stop import CONVERGED
from twin._checks import InputError
from twin.parameters import ParameterSpace

if TYPE_CHECKING:
    import pandas as pd

_SENTENCES = {
    "converged": "Converged: no step would reduce the cost noticeably.",
    "at_precision": "Converged to the precision of the cost: what is left of the gradient is rounding.",
    "stalled": "No step reduces the cost, yet the gradient is not zero: the cost or a constraint has a kink here. "
    "Widen its smoothing, or start elsewhere.",
    "not_finite": "Cost, constraints or their derivatives are not finite at the start. Start from a design whose "
    "simulation succeeds and whose measures exist (a response time needs a dwell that is long enough).",
    "too_many_steps": "Out of steps. Raise max_steps, or start closer.",
    "infeasible": "No design near here satisfies the constraints: this is the least infeasible one found. Relax a "
    "limit or a bound, or start elsewhere.",
}


@dataclasses.dataclass(frozen=True, repr=False)
class DesignResult:
    """A designed model, its cost and what holds it back. Shows itself as a table in a notebook."""

    model: Any
    """The designed model."""
    space: ParameterSpace
    """The free parameters."""
    start: np.ndarray
    """Values at the start, SI (parameters,)."""
    values: np.ndarray
    """Values of the design, SI (parameters,)."""
    cost: float
    """Cost of the design; NaN where it is not finite at the start."""
    history: np.ndarray
    """Cost of the best point so far, after each evaluation (evaluations,); it may rise where a constraint was not met
    before."""
    evaluations: int
    """Points at which cost and constraints were evaluated, the start included."""
    gradients: int
    """Points among them at which the derivatives were evaluated too; the solver that drives `design` runs a model anew
    for them."""
    active: np.ndarray
    """Which parameters sit on a bound that holds them back (parameters,)."""
    constraint_names: tuple[str, ...]
    """Names of the values of the constraints."""
    constraint_values: np.ndarray
    """Values of the constraints at the design: inequalities hold where they are not negative, equalities at zero."""
    stop: str
    """Name of the reason for stopping, one of `Stop`."""
    note: str = ""
    """What else the procedure has to say."""

    @property
    def success(self) -> bool:
        """Whether the design converged."""
        return self.stop in CONVERGED

    @property
    def binding(self) -> tuple[str, ...]:
        """Names of the constraints that are met with nothing to spare (1e-4)."""
        return tuple(n for n, v in zip(self.constraint_names, self.constraint_values, strict=True) if abs(v) <= 1e-4)

    @property
    def message(self) -> str:
        """What happened, and what to do about it."""
        parts = [_SENTENCES[self.stop]]
        if self.active.any():
            parts.append(f"Held back by a bound: {self.space.named(self.active)}.")
        if self.binding:
            parts.append(f"Held back by a constraint: {', '.join(self.binding)}.")
        return " ".join([*parts, self.note]).strip()

    def __getitem__(self, path: str) -> float:
        """Value of one parameter, SI.

        Raises:
            InputError: if it was not designed.
        """
        if path not in self.space.paths:
            raise InputError(f"{path!r} was not designed; designed were {', '.join(self.space.paths)}.")
        return float(self.values[self.space.paths.index(path)])

    def to_dataframe(self) -> "pd.DataFrame":
        """Table of the parameters: unit, start, value, bounds, remark."""
        import pandas as pd

        return pd.DataFrame(
            {
                "unit": self.space.units,
                "start": self.start,
                "value": self.values,
                "lower bound": [p.lower for p in self.space.parameters],
                "upper bound": [p.upper for p in self.space.parameters],
                "remark": ["at a bound" if held else "" for held in self.active],
            },
            index=pd.Index(self.space.paths, name="parameter"),
        )

    def constraints_to_dataframe(self) -> "pd.DataFrame":
        """Table of the constraints: value and remark."""
        import pandas as pd

        remarks = ["binding" if name in self.binding else "" for name in self.constraint_names]
        return pd.DataFrame(
            {"value": self.constraint_values, "remark": remarks},
            index=pd.Index(self.constraint_names, name="constraint"),
        )

    def _repr_html_(self) -> str:
        tables = [self.to_dataframe()] + ([self.constraints_to_dataframe()] if self.constraint_names else [])
        shown = "".join(table.to_html(float_format=lambda x: f"{x:.6g}") for table in tables)
        return f"<div><p><b>Design</b>: {self._facts()}.</p><p>{self.message}</p>{shown}</div>"

    def __repr__(self) -> str:
        table = self.to_dataframe().to_string(float_format=lambda x: f"{x:.6g}")
        return f"{table}\nDesign: {self._facts()}. {self.message}"

    def _facts(self) -> str:
        state = "converged" if self.success else "NOT converged"
        return (
            f"{state} to the cost {self.cost:.6g} in {self.evaluations} evaluations, {self.gradients} of them with "
            "derivatives"
        )
