"""Report on the reproduction of Leipe et al.: numbers, parameters and pictures in a folder, main numbers as text."""

import time
from pathlib import Path
from typing import Any

from fitting.identification.leipe import fit_printed_curves, study_direct, study_sweeps, validate
from fitting.identification.leipe_plots import draw_all
from fitting.identification.leipe_summary import summarise
from fitting.json_file import write_json
from fitting.result import FitResult
from twin.io.parameter_file import ParameterEntry, write_parameters


def reproduce_leipe(out: Path) -> dict[str, Any]:
    """Repeat Leipe et al. on a simulated bench, and write down how well that goes.

    Writes `summary.json`, `parameters.toml`, and one picture for each of the figures 4 to 8 and for the outlook.

    Args:
        out: folder for the files; made if it does not exist.

    Returns:
        The content of `summary.json`.
    """
    clock = time.perf_counter()
    out.mkdir(parents=True, exist_ok=True)
    curves = fit_printed_curves()
    sweeps = study_sweeps()
    direct = study_direct(sweeps)
    validation = validate(direct)
    summary = summarise(curves, sweeps, direct, validation)
    summary["seconds"] = time.perf_counter() - clock
    write_json(out / "summary.json", summary)
    write_parameters(out / "parameters.toml", _entries(direct.fits.joint) + _entries(validation.motors))
    draw_all(out, curves, sweeps, direct, validation)
    return summary


def tabulate(summary: dict[str, Any]) -> str:
    """The main numbers as text.

    Args:
        summary: of `reproduce_leipe`.
    """
    lines = ["Total stiffness and damping by the published chain, errors against the simulated bench [%]"]
    lines.append("  preload   k paper  k exact   d paper  d exact")
    rows = {(r["estimator"], r["preload_percent"]): r for r in summary["chain"]}
    for percent in sorted({key[1] for key in rows}):
        found = [_errors(rows[name, percent]) for name in ("paper", "exact")]
        (k_paper, d_paper), (k_exact, d_exact) = found
        note = "" if rows["exact", percent]["used"] else "  (not fitted)"
        lines.append(f"  {percent:6g} % {k_paper:9.2f}{k_exact:9.2f} {d_paper:9.2f}{d_exact:9.2f}{note}")
    lines.append("Direct fits, largest errors of k(F) and d(F) from 250 to 5000 N [%]")
    for name, fit in summary["direct"].items():
        k, d = fit["largest_stiffness_error_percent"], fit["largest_damping_error_percent"]
        lines.append(f"  {name:6} {k:7.2f} {d:7.2f}")
    errors, paper = summary["validation"]["mae_nm"], summary["validation"]["published_mae_nm"]
    lines.append(
        f"Validation move, mean absolute torque errors {errors[0]:.3f} and {errors[1]:.3f} Nm "
        f"(paper, on its own bench: {paper[0]:.3f} and {paper[1]:.3f} Nm)"
    )
    swarm = summary["swarm"]
    reached = all(swarm[law]["swarm_reached"] for law in ("stiffness", "damping"))
    more = "" if reached else "more than "
    paid, needed = swarm["gradient_evaluations"], swarm["evaluations"]
    lines.append(f"Curve fits: {paid} evaluations by gradients; a swarm needs {more}{needed}")
    return "\n".join(lines)


def _errors(row: dict[str, Any]) -> tuple[float, float]:
    if row["k"] is None:
        return float("nan"), float("nan")
    return 100 * (row["k"] / row["k_true"] - 1), 100 * (row["d"] / row["d_true"] - 1)


def _entries(result: FitResult) -> list[ParameterEntry]:
    return [
        ParameterEntry(p.path, float(v), p.unit, float(se), p.lower, p.upper, "simulated rack-and-pinion bench")
        for p, v, se in zip(result.space.parameters, result.values, result.standard_errors, strict=True)
    ]
