"""What a run of the benchmarks leaves behind: a table to read, and numbers to read back."""

import importlib.metadata
import os
import platform
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tests.benchmarks.emps_simulation import Comparison, Row
from tests.benchmarks.entrant import Timing

_PACKAGES = ("jax", "jaxlib", "equinox", "diffrax", "numpy", "scipy", "casadi")
_HEAD = (
    "entrant",
    "simulation min / median / max [ms] (calls)",
    "per tick [µs]",
    "Jacobian min / median / max [ms] (calls)",
    "compile or build [s]",
    "position error [m]",
    "Jacobian error [-]",
)


def machine() -> dict[str, Any]:
    """What the times depend on: processor, cores, systems and versions."""
    return {
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "load_at_end": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "xla_flags": os.environ.get("XLA_FLAGS", ""),
        **{name: importlib.metadata.version(name) for name in _PACKAGES},
    }


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


def as_markdown(comparisons: Sequence[Comparison], about: dict[str, Any]) -> str:
    """The report: for every comparison its ratios and its table, then the machine."""
    lines = ["# Benchmarks", ""]
    for comparison in comparisons:
        case = comparison.case
        lines += [f"## EMPS simulation: {case.name}, {case.ticks} ticks, {case.vector.size} parameters", ""]
        lines += [f"Reference: {case.source}. Ratios of shortest calls, of the fastest right entrant of each kind:", ""]
        lines += [f"- {name}: {ratio:.3g}" for name, ratio in comparison.ratios().items()]
        lines += ["", *table(comparison), ""]
    lines += ["## Machine", "", *[f"- {key}: {value}" for key, value in about.items() if value not in ("", None)], ""]
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
        "calls": spread.calls,
        "compile_s": timing.compile,
        "accurate": right,
    }


def _processor() -> str:
    information = Path("/proc/cpuinfo")
    if information.exists():
        for line in information.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or "unknown"
