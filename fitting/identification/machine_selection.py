"""One value for each stiffness out of all runs of the small problems: the mean of the problem that agrees most."""

import dataclasses
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from fitting.identification.machine_part_runs import PartRuns
from twin._checks import InputError
from twin.structure import Machine

if TYPE_CHECKING:
    import pandas as pd

PAPER, ROBUST = "paper", "robust"
"""Rules of selection."""
# Runs of a problem, as a share of all, that must be left for its agreement to mean anything; and never fewer than this.
_LEFT, _FEWEST = 0.2, 2


@dataclasses.dataclass(frozen=True, repr=False)
class StiffnessSelection:
    """The stiffnesses identified, and the runs that they come from."""

    runs: PartRuns
    """All runs of all problems."""
    rule: str
    """"paper" or "robust"."""
    value: Float[np.ndarray, "stiffnesses"]
    """Mean over the runs of the chosen problem [N/m, Nm/rad]; NaN for a stiffness that no problem tells."""
    deviation: Float[np.ndarray, "stiffnesses"]
    """Standard deviation over these runs [N/m, Nm/rad]."""
    problem: Int[np.ndarray, "stiffnesses"]
    """Number of the chosen problem; -1 for none."""
    used: Int[np.ndarray, "stiffnesses"]
    """Runs that the mean is over."""

    @property
    def missing(self) -> tuple[str, ...]:
        """Paths of the stiffnesses that no problem tells."""
        return tuple(path for path, number in zip(self.runs.paths, self.problem, strict=True) if number < 0)

    @property
    def failed(self) -> int:
        """Runs that failed."""
        return int(self.runs.failed.sum())

    def machine(self, machine: Machine) -> Machine:
        """A machine with the stiffnesses identified; those that no problem tells stay as they are.

        Args:
            machine: machine.
        """
        kept = np.flatnonzero(self.problem >= 0)
        if kept.size == 0:
            return machine
        space = self.runs.space.subset([self.runs.paths[i] for i in kept])
        order = [self.runs.paths.index(path) for path in space.paths]
        return space.with_values(machine, jnp.asarray(self.value[order]))

    def to_dataframe(self) -> "pd.DataFrame":
        """One row per stiffness: value, deviation, the problem that it comes from, runs used."""
        import pandas as pd

        units = [self.runs.space.units[i] for i in self.runs.stiffness]
        names = [self.runs.problems[i] if i >= 0 else "" for i in self.problem]
        columns = {"unit": units, "value": self.value, "deviation": self.deviation, "problem": names, "used": self.used}
        return pd.DataFrame(columns, index=pd.Index(self.runs.paths, name="parameter"))

    def __repr__(self) -> str:
        facts = f"rule {self.rule!r}; {self.failed} of {self.runs.failed.size} runs failed."
        facts += f" No problem tells {', '.join(self.missing)}." if self.missing else ""
        return f"{self.to_dataframe().to_string(float_format=lambda x: f'{x:.5g}')}\n{facts}"


def select_stiffness(runs: PartRuns, rule: str = PAPER, *, least_macxp: float = 0.99) -> StiffnessSelection:
    """Choose, for each stiffness, the problem whose runs agree most, and take the mean of these.

    "paper" is the rule as printed: the least standard deviation of all problems that searched the stiffness. Under
    model error it chooses problems whose runs all end on one bound, with a deviation of zero. "robust" leaves out runs
    in which the stiffness is on a bound, and runs whose modes are poorly alike. Failed runs count in neither.

    Args:
        runs: of `solve_parts`.
        rule: "paper" or "robust".
        least_macxp: MACXP below which a run is a poor fit, for the robust rule.

    Returns:
        The selection; a stiffness that no problem tells is marked.

    Raises:
        InputError: an unknown rule, a MACXP outside 0 to 1.

    Source: section 2.3.2 of J. Ellinger, M. F. Zaeh, Machines 10 (2022) 535.
    """
    require_rule(rule)
    if not 0 <= least_macxp < 1:
        raise InputError(f"least_macxp must be between 0 and 1, but is {least_macxp:g}.")
    counts = ~runs.failed[..., None] & runs.searched[:, None, :] & np.isfinite(runs.value)
    least = _FEWEST
    if rule == ROBUST:
        counts &= ~runs.on_bound & (runs.macxp >= least_macxp)[..., None]
        least = max(least, int(np.ceil(_LEFT * runs.macxp.shape[1])))
    left = counts.sum(axis=1)
    mean = np.where(counts, runs.value, 0.0).sum(axis=1) / np.maximum(left, 1)
    spread = np.where(counts, runs.value - mean[:, None], 0.0)
    deviation = np.sqrt((spread**2).sum(axis=1) / np.maximum(left, 1))
    ranked = np.where(left >= least, deviation, np.inf)
    problem = ranked.argmin(axis=0)
    told = np.isfinite(ranked.min(axis=0))

    def chosen(table: np.ndarray) -> np.ndarray:
        return np.take_along_axis(table, problem[None], axis=0)[0]

    return StiffnessSelection(
        runs,
        rule,
        np.where(told, chosen(mean), np.nan),
        np.where(told, chosen(deviation), np.nan),
        np.where(told, problem, -1),
        np.where(told, chosen(left), 0),
    )


def require_rule(rule: str) -> None:
    """Raise unless a rule of selection is known.

    Args:
        rule: "paper" or "robust".

    Raises:
        InputError: another one.
    """
    if rule not in (PAPER, ROBUST):
        raise InputError(f"rule must be {PAPER!r} or {ROBUST!r}, but is {rule!r}.")
