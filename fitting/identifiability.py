"""What a fit can and cannot tell: which parameters the data determine, and which only trade places with others."""

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from fitting.result import FitResult
from twin._checks import InputError
from twin.parameters import Parameter

if TYPE_CHECKING:
    import pandas as pd

IDENTIFIED = "identified"
CORRELATED = "correlated"
NOT_SEEN = "not seen"
AT_BOUND = "at a bound"


@dataclasses.dataclass(frozen=True)
class Verdict:
    """What the data say about one parameter."""

    path: str
    """The parameter."""
    kind: str
    """"identified", "correlated", "not seen" or "at a bound"."""
    partners: tuple[str, ...]
    """The parameters that it trades places with."""
    uncertainty: float
    """Standard error in units of the parameter's plausible range; infinite where nothing limits it."""
    alone: float
    """The same if all other parameters were known."""
    collinearity: float
    """By how much correlation with the others inflates the standard error: 1 where there is none."""

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        if self.kind == CORRELATED:
            return f"correlated with {', '.join(self.partners)}"
        return "not seen by these data" if self.kind == NOT_SEEN else self.kind


@dataclasses.dataclass(frozen=True, repr=False)
class IdentifiabilityReport:
    """Verdicts on all parameters of a fit. Shows itself as a table in a notebook."""

    verdicts: tuple[Verdict, ...]
    """One per parameter."""
    collinearity_index: float
    """1/√(least eigenvalue of the normalised information) of the parameters not on a bound (R. Brun, P. Reichert and
    H. R. Künsch, Water Resources Research 37 (2001), eq. 10): a change of one can be made up by the others but for
    1/index of its effect."""

    def __getitem__(self, path: str) -> Verdict:
        for verdict in self.verdicts:
            if verdict.path == path:
                return verdict
        raise InputError(f"{path!r} was not fitted; fitted were {', '.join(v.path for v in self.verdicts)}.")

    @property
    def groups(self) -> tuple[tuple[str, ...], ...]:
        """Sets of parameters that only their combination is known of."""
        groups: list[set[str]] = []
        for verdict in self.verdicts:
            if verdict.kind != CORRELATED:
                continue
            new = {verdict.path, *verdict.partners}
            for old in [g for g in groups if g & new]:
                groups.remove(old)
                new |= old
            groups.append(new)
        order = [v.path for v in self.verdicts]
        return tuple(tuple(sorted(g, key=order.index)) for g in groups)

    @property
    def message(self) -> str:
        """What to do."""
        parts = []
        for group in self.groups:
            parts.append(
                f"Only a combination of {', '.join(group)} is known: hold all but one, give a prior, or measure what "
                "tells them apart (fitting.design.rank_experiments says what would)."
            )
        unseen = [v.path for v in self.verdicts if v.kind == NOT_SEEN]
        if unseen:
            parts.append(f"Nothing in these data depends enough on {', '.join(unseen)}: hold or measure otherwise.")
        bound = [v.path for v in self.verdicts if v.kind == AT_BOUND]
        if bound:
            parts.append(f"On a bound: {', '.join(bound)}; the others' uncertainty takes these as known.")
        return " ".join(parts) or "All parameters are identified."

    def to_dataframe(self) -> "pd.DataFrame":
        """Table of the verdicts."""
        import pandas as pd

        rows = [[v.sentence, v.uncertainty, v.alone, v.collinearity] for v in self.verdicts]
        names = ["verdict", "standard error / range", "if the others were known", "inflation"]
        return pd.DataFrame(rows, columns=names, index=pd.Index([v.path for v in self.verdicts], name="parameter"))

    def _repr_html_(self) -> str:
        table = self.to_dataframe().to_html(float_format=lambda x: f"{x:.3g}")
        index = f"Collinearity index {self.collinearity_index:.3g}. "
        return f"<div><p><b>Identifiability</b>: {index}{self.message}</p>{table}</div>"

    def __repr__(self) -> str:
        return f"{self.to_dataframe().to_string(float_format=lambda x: f'{x:.3g}')}\n{self.message}"


def identifiability(result: FitResult, *, limit: float = 0.25) -> IdentifiabilityReport:
    """Which parameters of a fit its data determine.

    A parameter is determined if its standard error is small beside its plausible range: the width of its bounds, on its
    own scale; without bounds, its value on a linear scale, and a factor of e on a logarithmic one. One that is not
    would either be undetermined even if all others were known (not seen), or only trades places with others
    (correlated): these are found as the parameters that take part in the directions of the normalised Jacobian that its
    variance comes from.

    Args:
        result: a fit.
        limit: standard error, in units of the range, above which a parameter is not determined.

    Returns:
        A verdict on each parameter.

    Raises:
        InputError: a fit without a finite Jacobian, or a limit that is not positive.
    """
    if not limit > 0:
        raise InputError(f"limit must be positive, but is {limit}.")
    if not np.all(np.isfinite(result.factor)):
        raise InputError("This fit has no finite Jacobian, so nothing can be said. " + result.message)
    names = result.space.paths
    free = [int(i) for i in np.flatnonzero(~result.active)]
    norms = np.linalg.norm(result.factor, axis=0)
    ranges = np.asarray([plausible_range(p, x) for p, x in zip(result.space.parameters, result.scaled, strict=True)])
    with np.errstate(divide="ignore"):
        alone = np.where(norms > 0, result.deviation / norms, np.inf) / ranges

    seen = [i for i in free if norms[i] > 0]
    # Parameters whose data are pure rounding beside others' would make every direction they are in look weak.
    normal = result.factor[:, seen] / norms[seen] if seen else np.zeros((0, 0))
    _, values, directions = (
        np.linalg.svd(normal, full_matrices=False) if seen else (None, np.zeros(0), np.zeros((0, 0)))
    )
    floor = 1e-11 * values[0] if values.size else 0.0
    # Covariance of the estimates in units of their standard errors alone, what is not seen at all cut off.
    spread = directions.T / np.maximum(values, floor) ** 2 @ directions
    inflation = dict(zip(seen, np.sqrt(np.diag(spread)), strict=True))
    factors = {i: np.inf if f >= 1e9 else float(f) for i, f in inflation.items()}
    total = np.asarray([alone[i] * factors.get(i, 1.0) for i in range(len(names))])
    traded = [i for i in free if total[i] > limit >= alone[i]]

    verdicts = []
    for i, path in enumerate(names):
        factor, partners = factors.get(i, 1.0), ()
        if result.active[i]:
            # What the data do not feel may drift to a bound, which then holds back nothing.
            kind = NOT_SEEN if alone[i] > limit else AT_BOUND
            verdicts.append(Verdict(path, kind, (), np.nan, alone[i], np.nan))
            continue
        if i in traded:
            kind, partners = CORRELATED, tuple(names[j] for j in _partners(spread, seen, i, traded))
        else:
            kind = IDENTIFIED if total[i] <= limit else NOT_SEEN
        verdicts.append(Verdict(path, kind, partners, float(total[i]), float(alone[i]), factor))
    index = float(1 / values[-1]) if values.size and values[-1] > floor else (np.inf if values.size else 1.0)
    return IdentifiabilityReport(tuple(verdicts), index)


def _partners(spread: np.ndarray, seen: list[int], me: int, traded: list[int]) -> list[int]:
    """Others that a parameter trades places with: undetermined too, and correlated with it.

    Correlations do not depend on how directions that are equally weak happen to be mixed, as singular vectors do. A
    product of n factors correlates each pair by 1/(n - 1).
    """
    at = seen.index(me)
    size = np.sqrt(np.diag(spread))
    correlation = np.abs(spread[at] / (size[at] * size))
    others = [j for j in traded if j != me and correlation[seen.index(j)] > 0.1]
    if others:
        return others
    correlation[at] = -1.0
    return [seen[int(np.argmax(correlation))]]


def plausible_range(parameter: Parameter, scaled: float) -> float:
    """Plausible range of a parameter on its scale: between its bounds, else as far as its value, or a factor of e.

    Args:
        parameter: the parameter.
        scaled: its value on its scale.
    """
    low, high = (float(parameter.to_scaled(bound)) for bound in (parameter.lower, parameter.upper))
    if np.isfinite(low) and np.isfinite(high):
        return high - low
    return 1.0 if parameter.scale == "log" else max(abs(scaled), 1e-300)
