"""Section: which parameters matter for which output."""

from collections.abc import Mapping

import numpy as np

from fitting.report.content import Cell, Section, Table
from sensitivity.derivative_result import DerivativeMeasures
from sensitivity.sobol_result import SobolIndices

_MOST_COLUMNS = 60


def ranking_section(ranking: SobolIndices | DerivativeMeasures, *, names: Mapping[str, str] | None = None) -> Section:
    """Sensitivity of every output to every parameter as a map.

    Args:
        ranking: Sobol study, shown by its total effects, or a derivative-based one, by their upper bounds.
        names: what to write instead of a parameter's path, by path.
    """
    paths, written = tuple(ranking.names), dict(names or {})
    sobol = isinstance(ranking, SobolIndices)
    shares, half = (ranking.ST, ranking.ST_conf) if sobol else (ranking.bound, ranking.bound_conf)
    outputs = list(range(len(ranking.outputs)))[:_MOST_COLUMNS]
    order = np.argsort(-np.max(np.where(np.isfinite(shares), shares, 0.0), axis=0, initial=0.0), kind="stable")
    rows = tuple(
        (
            Cell(written[paths[k]] if paths[k] in written else paths[k], "name"),
            *(_cell(float(shares[o, k])) for o in outputs),
        )
        for k in order
    )
    what = "Total effect S_T [-]" if sobol else "Upper bound of the total effect [-]"
    text = (
        "The total effect is the share of an output's variance that stays if all other parameters were known: what is "
        "near zero may be held fixed."
        if sobol
        else "The bound is what the total effect of a parameter is at most: what is near zero may be held fixed. It "
        "may exceed one."
    )
    remarks = [
        f"{ranking.n} base points, seed {ranking.seed}; half widths of the {100 * ranking.confidence:g} % intervals "
        f"are at most {float(np.nanmax(half, initial=0.0)):.2g}."
    ]
    if len(ranking.outputs) > _MOST_COLUMNS:
        remarks.append(f"Only the first {_MOST_COLUMNS} of {len(ranking.outputs)} outputs are shown.")
    still = [name for name, v in zip(ranking.outputs, ranking.variance, strict=True) if v == 0]
    if still:
        remarks.append(f"Nothing moves {', '.join(still)}.")
    return Section(
        "Sensitivity",
        text=text,
        tables=(Table(("", *(ranking.outputs[o] for o in outputs)), rows, what, map=True),),
        remarks=tuple(remarks),
    )


def _cell(share: float) -> Cell:
    if not np.isfinite(share):
        return Cell("×")
    text = "" if share < 0.005 else f"{share:.2f}"
    return Cell(text, tint=-float(np.sqrt(np.clip(share, 0.0, 1.0))))
