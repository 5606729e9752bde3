"""What the section on the EMPS simulation leaves behind: ratios, a table, plain numbers."""

from collections.abc import Sequence
from typing import Any

from tests.benchmarks.emps_simulation import CVODES, JACOBIAN_LIMIT, POSITION_LIMIT, SCIPY, Comparison, Row
from tests.benchmarks.entrant import Timing
from tests.benchmarks.summary import SummaryRow, ratio_row

GOALS = {("simulation", SCIPY): 10.0, ("Jacobian", SCIPY): 10.0, ("Jacobian", CVODES): 1.0}
"""Least ratio, by what is compared with whom."""
_HEAD = (
    "entrant",
    "simulation min / median / max [ms] (calls)",
    "per tick [µs]",
    "Jacobian min / median / max [ms] (calls)",
    "compile or build [s]",
    "position error [m]",
    "Jacobian error [-]",
)


def as_dictionary(comparison: Comparison) -> dict[str, Any]:
    """A comparison as plain numbers and names, times in seconds."""
    case = comparison.case
    return {
        "case": case.name,
        "ticks": case.ticks,
        "parameters": list(case.space.paths),
        "reference": case.source,
        "ratios": comparison.ratios(),
        "entrants": [_row_dictionary(row) for row in comparison.rows],
    }


def summary_rows(comparison: Comparison) -> list[SummaryRow]:
    """Every peer against the twin, by the fastest right entrant of each."""
    rows = []
    for kind, peer, theirs, ours in comparison.pairs():
        limit, unit = (JACOBIAN_LIMIT, "") if kind == "Jacobian" else (POSITION_LIMIT, " m")
        errors = [row.jacobian_error if kind == "Jacobian" else row.position_error for row in (ours, theirs)]
        agreement = f"twin to {errors[0]:.0e}{unit}, peer to {errors[1]:.0e}{unit}, limit {limit:.0e}{unit}"
        times = [(row.jacobian if kind == "Jacobian" else row.simulation).spread.turns for row in (theirs, ours)]
        what = f"EMPS {kind}, {comparison.case.name}, {comparison.case.ticks} ticks"
        rows.append(ratio_row(what, f"{peer}: {theirs.entrant.name}", *times, agreement, least=GOALS.get((kind, peer))))
    return rows


def as_markdown(comparisons: Sequence[Comparison]) -> str:
    """For every comparison its ratios and its table."""
    lines = []
    for comparison in comparisons:
        case = comparison.case
        lines += [f"## EMPS simulation: {case.name}, {case.ticks} ticks, {case.vector.size} parameters", ""]
        lines += [f"Reference: {case.source}. Ratios of shortest calls, of the fastest right entrant of each kind:", ""]
        lines += [f"- {name}: {ratio:.3g}" for name, ratio in comparison.ratios().items()]
        lines += ["", *table(comparison), ""]
    return "\n".join(lines)


def table(comparison: Comparison) -> list[str]:
    """The rows of a comparison as lines of a Markdown table with aligned columns."""
    cells = [_HEAD, *(_cells(row, comparison.case.ticks) for row in comparison.rows)]
    widths = [max(len(row[i]) for row in cells) for i in range(len(_HEAD))]
    lines = ["| " + " | ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)) + " |" for row in cells]
    return [lines[0], "|" + "|".join("-" * (w + 2) for w in widths) + "|", *lines[1:]]


def _cells(row: Row, ticks: int) -> tuple[str, ...]:
    building = row.entrant.build + row.simulation.compile + (row.jacobian.compile if row.jacobian else 0.0)
    return (
        row.entrant.name,
        _times(row.simulation, row.right_simulation),
        f"{1e6 * row.simulation.spread.min / ticks:.3g}",
        _times(row.jacobian, row.right_jacobian) if row.jacobian else "",
        f"{building:.1f}",
        f"{row.position_error:.1e}",
        f"{row.jacobian_error:.1e}" if row.jacobian else "",
    )


def _times(timing: Timing, right: bool) -> str:
    spread = timing.spread
    times = " / ".join(f"{1e3 * t:.4g}" for t in (spread.min, spread.median, spread.max))
    return f"{times} ({spread.calls})" + ("" if right else " not accurate enough")


def _row_dictionary(row: Row) -> dict[str, Any]:
    return {
        "name": row.entrant.name,
        "role": row.entrant.role,
        "build_s": row.entrant.build,
        "simulation": _timing_dictionary(row.simulation, row.right_simulation),
        "jacobian": _timing_dictionary(row.jacobian, row.right_jacobian) if row.jacobian else None,
        "position_error_m": row.position_error,
        "jacobian_error": row.jacobian_error if row.jacobian else None,
    }


def _timing_dictionary(timing: Timing, right: bool) -> dict[str, Any]:
    spread = timing.spread
    return {
        "min_s": spread.min,
        "median_s": spread.median,
        "max_s": spread.max,
        "turns_s": spread.turns,
        "calls": spread.calls,
        "compile_s": timing.compile,
        "accurate": right,
    }
