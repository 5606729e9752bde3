"""Report on the reproduction of Mauro et al.: numbers, parameters and pictures in a folder, main numbers as text."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting.identification.mauro_design import DesignStudy, study_design
from fitting.identification.mauro_plots import draw_all
from fitting.identification.mauro_structure import Structure, study_structure
from fitting.identification.mauro_study import (
    PrintedCost,
    TableStudy,
    column_errors,
    study_cost,
    study_table,
)
from fitting.identification.mauro_table import mauro_table
from fitting.json_file import write_json
from twin.drives import PerSpring
from twin.io.parameter_file import ParameterEntry, write_parameters

if TYPE_CHECKING:
    import pandas as pd


def reproduce_mauro(out: Path) -> dict[str, Any]:
    """Repeat Mauro et al.: modal analysis, Table 1 by a fitted twin, and gains found by gradients.

    Writes `summary.json`, `parameters.toml`, `table1.csv`, and one picture for each of the figures 6 to 11, the
    residuals and the trade-off.

    Args:
        out: folder for the files; made if it does not exist.

    Returns:
        The content of `summary.json`.
    """
    clock = time.perf_counter()
    out.mkdir(parents=True, exist_ok=True)
    structure, printed, study = study_structure(), study_cost(), study_table()
    design = study_design(study)
    summary = summarise(structure, printed, study, design)
    draw_all(out, structure, study, design)
    summary["seconds"] = time.perf_counter() - clock
    write_json(out / "summary.json", summary)
    table_of(study).to_csv(out / "table1.csv", index=False)
    result = study.fit
    write_parameters(
        out / "parameters.toml",
        [
            ParameterEntry(
                p.path,
                float(v),
                p.unit or "1",
                float(se) if np.isfinite(se) else None,
                p.lower,
                p.upper,
                "Mauro et al., Table 1",
            )
            for p, v, se in zip(result.space.parameters, result.values, result.standard_errors, strict=True)
        ],
    )
    return summary


def summarise(structure: Structure, printed: PrintedCost, study: TableStudy, design: DesignStudy) -> dict[str, Any]:
    """The content of `summary.json`.

    Args:
        structure: modal analysis.
        printed: eq. 22 on the printed columns.
        study: the twin behind Table 1.
        design: gains found by gradients.
    """
    table, rows = mauro_table(), table_of(study)
    errors, six = column_errors(study.rows), column_errors(study.six_degrees)
    first = structure.elasticities.values[1]
    support = structure.support_sweep["first_frequency"]
    return {
        "first_frequency_hz": float(structure.frequencies[1]),
        "damping_ratio": float(structure.damping_ratios[1]),
        "modal_deformation": structure.deformations,
        "elasticity": dict(zip(PerSpring._fields, np.asarray(first).tolist(), strict=True)),
        "elasticity_sum": float(np.sum(first)),
        "elasticity_deviation": {
            "closed_form": float(np.max(np.abs(first - structure.closed_form))),
            "central_differences": float(np.max(np.abs(first - structure.differences))),
        },
        "support_sweep_hz": {
            "0.5": float(support[0]),
            "1.0": float(structure.frequencies[1]),
            "1.5": float(support[-1]),
        },
        "printed_cost": {"largest_deviation": printed.largest_deviation, "optimum_k_v": printed.optimum},
        "table1": [
            {
                "k_v": float(table.gain[i]),
                "tau": float(study.rows.time[i]),
                "error_um": float(1e6 * abs(study.rows.error[i])),
                "signed_error_um": float(1e6 * study.rows.error[i]),
                "energy_kj": float(1e-3 * study.rows.energy[i]),
                "cost": float(study.cost[i]),
                "six_degrees_of_freedom": {
                    "tau": float(study.six_degrees.time[i]),
                    "signed_error_um": float(1e6 * study.six_degrees.error[i]),
                    "energy_kj": float(1e-3 * study.six_degrees.energy[i]),
                },
                "paper": {
                    "tau": float(table.time[i]),
                    "error_um": float(table.error[i]),
                    "energy_kj": float(table.energy[i]),
                    "cost": float(table.cost[i]),
                },
            }
            for i in range(len(rows))
        ],
        "cost_optimum_k_v": float(table.gain[np.argmin(study.cost)]),
        "rms": {
            "time_percent": 100 * errors.time,
            "energy_percent": 100 * errors.energy,
            "error_um": 1e6 * errors.error,
            "six_degrees_of_freedom": {
                "time_percent": 100 * six.time,
                "energy_percent": 100 * six.energy,
                "error_um": 1e6 * six.error,
            },
        },
        "converged": {
            "error_um_by_four_times_the_step": float(1e6 * np.max(np.abs(study.coarse.error - study.rows.error))),
            "error_um_by_half_the_presliding": float(
                1e6 * np.max(np.abs(study.half_presliding.error - study.rows.error))
            ),
            "error_um_rigid_against_six_degrees": float(
                1e6 * np.max(np.abs(study.six_degrees.error - study.rows.error))
            ),
        },
        "fit": {
            "message": study.fit.message,
            "steps": study.fit.steps,
            "cost_at_the_start": float(study.fit.cost_history[0]),
            "cost": study.fit.cost,
            "parameters": {
                path: {
                    "value": float(study.fit.values[i]),
                    "standard_error": float(study.fit.standard_errors[i]),
                    "unit": study.fit.space.units[i],
                    "bounds": [study.fit.space[path].lower, study.fit.space[path].upper],
                    "verdict": study.seen[path].sentence,
                }
                for i, path in enumerate(study.fit.space.paths)
            },
            "identifiability": study.seen.message,
        },
        "design": design.summary(),
    }


def table_of(study: TableStudy) -> "pd.DataFrame":
    """Table 1, printed and simulated, in its units, as a pandas DataFrame.

    Args:
        study: the twin behind Table 1.
    """
    import pandas as pd

    table, rows = mauro_table(), study.rows
    return pd.DataFrame(
        {
            "k_v [1/min]": table.gain,
            "error [µm]": 1e6 * np.abs(rows.error),
            "error printed [µm]": table.error,
            "time [s]": rows.time,
            "time printed [s]": table.time,
            "energy [kJ]": 1e-3 * rows.energy,
            "energy printed [kJ]": table.energy,
            "cost": study.cost,
            "cost printed": table.cost,
        }
    )


def tabulate(summary: dict[str, Any]) -> str:
    """The main numbers as text.

    Args:
        summary: of `reproduce_mauro`.
    """
    lines = [
        f"First natural frequency {summary['first_frequency_hz']:.2f} Hz, damping ratio {summary['damping_ratio']:.4f}",
        "Table 1, twin against paper",
        "  k_v 1/min    error µm         energy kJ         time s          cost",
    ]
    for row in summary["table1"]:
        paper = row["paper"]
        lines.append(
            f"  {row['k_v']:8.0f} {row['error_um']:8.1f} {paper['error_um']:5.0f}  {row['energy_kj']:8.3f} "
            f"{paper['energy_kj']:6.3f}  {row['tau']:7.4f} {paper['tau']:6.3f}  {row['cost']:7.3f} {paper['cost']:7.3f}"
        )
    rms = summary["rms"]
    lines.append(
        f"RMS over the rows: error {rms['error_um']:.1f} µm, energy {rms['energy_percent']:.2f} %, time "
        f"{rms['time_percent']:.3f} %; least cost at k_v = {summary['cost_optimum_k_v']:.0f} 1/min"
    )
    lines.append(f"What the table can and cannot see: {summary['fit']['identifiability']}")
    design = summary["design"]
    lines.append(
        f"Best gain by gradients: cost {design['gain_alone']['cost']:.4f} in {design['gain_alone']['evaluations']} "
        f"evaluations; all gains together: {design['cost']:.4f} in {design['evaluations']}"
    )
    return "\n".join(lines)
