"""Report on the reproduction of Leipe et al.: numbers, parameters and pictures."""

import json
import time
from pathlib import Path
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.identification.leipe import (
    RATED_TORQUE,
    SWEEP_START,
    CurveFits,
    DirectStudy,
    SweepStudy,
    Validation,
    choose_preloads,
    fit_printed_curves,
    study_direct,
    study_sweeps,
    validate,
)
from fitting.identification.leipe_bench import PERIOD, bench_drive
from fitting.identification.leipe_plots import draw_all
from fitting.identification.leipe_reconstruction import reconstruct
from fitting.identification.load_surface import LoadSurfaceFit
from fitting.identification.particle_swarm import SwarmResult
from fitting.identification.preload_direct import curve_errors, curve_intervals
from fitting.identification.swarm_price import swarm_price
from fitting.result import FitResult
from twin.drives import RackPinionDrive
from twin.drives.rack_pinion_operation import table_response
from twin.io.parameter_file import ParameterEntry, write_parameters

PUBLISHED = {"stiffness": 4.01, "damping": 4.51, "validation": (0.4042, 0.3271)}
"""Remaining errors of the curve fits [%] and mean absolute torque errors [Nm] of the paper."""
_FORCES = np.geomspace(250.0, 5000.0, 40)


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
    text = json.dumps(_without_nan(summary), indent=2, allow_nan=False)
    (out / "summary.json").write_text(text + "\n", encoding="utf-8")
    write_parameters(out / "parameters.toml", _entries(direct.fits.joint) + _entries(validation.motors))
    draw_all(out, curves, sweeps, direct, validation)
    return summary


def summarise(curves: CurveFits, sweeps: SweepStudy, direct: DirectStudy, validation: Validation) -> dict[str, Any]:
    """The numbers of the reproduction.

    Args:
        curves: fits to the printed laws.
        sweeps: sweeps and chain.
        direct: direct fits.
        validation: the validation move.
    """
    return {
        "curve_fit": {
            "stiffness": _curve(curves.clean[0], curves.scattered[0], ("k1", "k2")),
            "damping": _curve(curves.clean[1], curves.scattered[1], ("d1", "d2", "d3")),
        },
        "chain": _chain(sweeps),
        "chain_fit": {
            chain.estimator: {
                "stiffness_error_percent": chain.stiffness.error_percent,
                "damping_error_percent": chain.damping.error_percent,
            }
            for chain in (sweeps.paper, sweeps.exact)
        },
        "linearised": _linearised(sweeps),
        "direct": {name: _direct(getattr(direct.fits, name)) for name in ("frf", "time", "joint")},
        "static": _parameters(direct.static),
        "validation": {
            "mae_nm": list(validation.mean_absolute_errors),
            "published_mae_nm": list(PUBLISHED["validation"]),
            "motors": _parameters(validation.motors),
        },
        "swarm": _swarm(sweeps),
        "reconstruction_um": _reconstruction(direct, validation),
        "preload_choice": _choices(validation),
    }


def _without_nan(value: Any) -> Any:
    """What JSON can hold: numbers that are not finite become null."""
    if isinstance(value, dict):
        return {key: _without_nan(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_without_nan(entry) for entry in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


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
    lines.append(f"Curve fits: {swarm['gradient_evaluations']} evaluations, a swarm needs {swarm['evaluations']}")
    return "\n".join(lines)


def _errors(row: dict[str, Any]) -> tuple[float, float]:
    if row["k"] is None:
        return float("nan"), float("nan")
    return 100 * (row["k"] / row["k_true"] - 1), 100 * (row["d"] / row["d_true"] - 1)


def _curve(clean: LoadSurfaceFit, scattered: LoadSurfaceFit, names: tuple[str, ...]) -> dict[str, Any]:
    found = {name: float(clean.result[name].value) for name in names}
    return {
        **found,
        "error_percent": clean.error_percent,
        "with_4_percent_scatter": {
            **{name: scattered.result[name]._asdict() for name in names},
            "error_percent": scattered.error_percent,
        },
    }


def _chain(sweeps: SweepStudy) -> list[dict[str, Any]]:
    rows = []
    for chain in (sweeps.paper, sweeps.exact):
        for point, (k, d) in zip(chain.points, sweeps.true_totals.tolist(), strict=True):
            rows.append(
                {
                    "preload_percent": point.preload_percent,
                    "k": None if point.peak is None else point.peak.stiffness,
                    "d": None if point.peak is None else point.peak.damping,
                    "k_true": k,
                    "d_true": d,
                    "estimator": chain.estimator,
                    "natural_frequency_hz": None if point.peak is None else point.peak.frequency,
                    "magnitude": None if point.peak is None else point.peak.magnitude,
                    "used": point.used,
                }
            )
    return rows


def _linearised(sweeps: SweepStudy) -> list[dict[str, float]]:
    """Sweep against the true drive linearised about its mean forces, 60 to 140 Hz."""
    rows = []
    first = round(SWEEP_START / PERIOD)
    for measurement, point in zip(sweeps.measurements, sweeps.exact.points, strict=True):
        response = point.response.between(60.0, 140.0)
        forces = jnp.mean(measurement.forces[:, first:], axis=1)
        model = np.asarray(_linear_response(bench_drive(), forces, response.frequency)).sum(axis=0)
        error = np.abs(np.asarray(response.values[0, 0]) - model)
        deviation = np.sqrt(np.asarray(response.variance)[0, 0])
        rows.append(
            {
                "preload_percent": point.preload_percent,
                "relative_error": float(np.sqrt(np.mean(error**2) / np.mean(np.abs(model) ** 2))),
                "over_random_error": float(np.sqrt(np.mean((error / deviation) ** 2))),
            }
        )
    return rows


@eqx.filter_jit
def _linear_response(drive: RackPinionDrive, forces: Array, frequency: Array) -> Array:
    return table_response(drive, forces, frequency, velocity=0.005)


def _direct(result: FitResult) -> dict[str, Any]:
    k, d = curve_errors(result.model.drive, bench_drive(), _FORCES)
    return {
        "parameters": _parameters(result),
        "largest_stiffness_error_percent": 100 * float(jnp.max(jnp.abs(k))),
        "largest_damping_error_percent": 100 * float(jnp.max(jnp.abs(d))),
        "force_range_n": [float(_FORCES[0]), float(_FORCES[-1])],
        "largest_interval_percent": curve_intervals(result, _FORCES),
        "status": result.message,
    }


def _parameters(result: FitResult) -> dict[str, Any]:
    ends = dict(zip(result.space.paths, result.intervals().tolist(), strict=True))
    return {path: {**e._asdict(), "interval_95": ends[path]} for path, e in result.estimates().items()}


def swarms(sweeps: SweepStudy) -> dict[str, tuple[SwarmResult, int]]:
    """What a swarm pays for the errors of the chain's curve fits, next to what the gradient fits paid.

    Args:
        sweeps: of which the exact chain's points are used.
    """
    forces, totals = sweeps.exact.fitted_totals()
    return {name: swarm_price(getattr(sweeps.exact, name), forces, totals[name]) for name in totals}


def _swarm(sweeps: SweepStudy) -> dict[str, Any]:
    found = swarms(sweeps)
    return {
        "evaluations": sum(swarm.evaluations for swarm, _ in found.values()),
        "gradient_evaluations": sum(paid for _, paid in found.values()),
        **{
            name: {"evaluations": s.evaluations, "gradient_evaluations": paid, "swarm_reached": s.reached}
            for name, (s, paid) in found.items()
        },
    }


def _reconstruction(direct: DirectStudy, validation: Validation) -> dict[str, dict[str, float]]:
    """Rms errors of the table position made from motor encoders [µm]."""
    return {
        name: {key: 1e6 * float(np.sqrt(np.mean(error**2))) for key, error in found.errors.items()}
        for name, found in reconstruct(direct, validation).items()
    }


def _choices(validation: Validation) -> list[dict[str, float]]:
    loads = [0.0, 1000.0, 2000.0]
    chosen = choose_preloads(validation.drive, 1.3e8, loads)
    return [
        {
            "load_n": load,
            "stiffness": float(choice.stiffness),
            "preload_percent": 100 * float(choice.preload) / RATED_TORQUE,
            "copper_loss_w": float(choice.copper_loss),
            "extra_loss_w": float(choice.extra_loss),
        }
        for load, choice in zip(loads, chosen, strict=True)
    ]


def _entries(result: FitResult) -> list[ParameterEntry]:
    return [
        ParameterEntry(p.path, float(v), p.unit, float(se), p.lower, p.upper, "simulated rack-and-pinion bench")
        for p, v, se in zip(result.space.parameters, result.values, result.standard_errors, strict=True)
    ]
