"""What a run of the benchmarks leaves behind: the summary and all sections to read, and numbers to read back."""

import importlib.metadata
import json
import os
import platform
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax

from tests.benchmarks import summary
from tests.benchmarks.sections import Section

_PACKAGES = (
    *("jax", "jaxlib", "equinox", "diffrax", "optimistix", "numpy", "scipy"),
    *("casadi", "pyswarms", "SALib", "slsqp-jax"),
)


def machine() -> dict[str, Any]:
    """What the times depend on: processor, device, load, systems and versions."""
    return {
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "device": f"{jax.devices()[0].device_kind} ({jax.default_backend()}, {jax.device_count()})",
        "memory_gib": _memory(),
        "load": _load(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "xla_flags": os.environ.get("XLA_FLAGS", ""),
        **{name: _version(name) for name in _PACKAGES},
    }


def write(folder: Path, found: Mapping[str, Section], about: Mapping[str, Any]) -> str:
    """Write what the sections have found so far.

    Args:
        folder: for `benchmarks.json` and `benchmarks.md`.
        found: sections by name.
        about: the machine as the run began.

    Returns:
        The report.
    """
    about = {**about, "load_at_end": _load()}
    rows = {name: section.summary for name, section in found.items()}
    text = as_markdown([row for own in rows.values() for row in own], [s.text for s in found.values()], about)
    together = [{"section": name, **row} for name, own in rows.items() for row in summary.as_dictionary(own)]
    numbers = {"machine": about, "summary": together, **{name: s.results for name, s in found.items()}}
    (folder / "benchmarks.md").write_text(text, encoding="utf-8")
    (folder / "benchmarks.json").write_text(json.dumps(numbers, indent=2), encoding="utf-8")
    return text


def as_markdown(rows: list[summary.SummaryRow], sections: list[str], about: Mapping[str, Any]) -> str:
    """The report: summary, machine, then the sections."""
    known = {key: value for key, value in about.items() if value not in ("", None)}
    machine_lines = ["## Machine", "", *(f"- {key}: {value}" for key, value in known.items()), ""]
    return "\n".join(["# Benchmarks", "", summary.as_markdown(rows), *machine_lines, *sections])


def _version(name: str) -> str | None:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None


def _load() -> float | None:
    """Processes that wanted a core, the mean of a minute."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else None


def _memory() -> float | None:
    known = hasattr(os, "sysconf") and "SC_PHYS_PAGES" in os.sysconf_names
    return round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30, 1) if known else None


def _processor() -> str:
    information = Path("/proc/cpuinfo")
    if information.exists():
        for line in information.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or "unknown"
