"""The numbers of the reproduction of Leipe et al., as they go into its summary."""

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
)
from fitting.identification.leipe_bench import PERIOD, bench_drive
from fitting.identification.leipe_curves import profile_curves
from fitting.identification.leipe_reconstruction import reconstruct
from fitting.identification.load_surface import LoadSurfaceFit
from fitting.identification.preload_direct import curve_errors, curve_intervals
from fitting.identification.swarm_price import swarm_price
from fitting.profile import ProfileResult
from fitting.result import FitResult
from twin.drives import RackPinionDrive
from twin.drives.rack_pinion_operation import table_response

PUBLISHED = {"stiffness": 4.01, "damping": 4.51, "validation": (0.4042, 0.3271)}
"""Remaining errors of the curve fits [%] and mean absolute torque errors [Nm] of the paper."""
_FORCES = np.geomspace(250.0, 5000.0, 40)


def summarise(curves: CurveFits, sweeps: SweepStudy, direct: DirectStudy, validation: Validation) -> dict[str, Any]:
    """The numbers of the reproduction.

    Args:
        curves: fits to the printed laws.
        sweeps: sweeps and chain.
        direct: direct fits.
        validation: the validation move.
    """
    profiles = profile_curves(curves)
    return {
        "curve_fit": {
            "stiffness": _curve(curves.clean[0], curves.scattered[0], profiles[0], ("k1", "k2")),
            "damping": _curve(curves.clean[1], curves.scattered[1], profiles[1], ("d1", "d2", "d3")),
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
        "truth": _truth(),
        "validation": {
            "mae_nm": list(validation.mean_absolute_errors),
            "mae_while_moving_nm": list(validation.errors_while_moving),
            "published_mae_nm": list(PUBLISHED["validation"]),
            "motors": _parameters(validation.motors),
        },
        "swarm": _swarm(sweeps),
        "reconstruction_um": _reconstruction(direct, validation),
        "preload_choice": _choices(validation),
    }


def _truth() -> dict[str, float]:
    """What the bench has where a fit gives a number."""
    drive: Any = bench_drive()
    mesh = drive.train_1.mesh
    return {
        "stiffness.k1": float(mesh.stiffness.k1),
        "stiffness.k2": float(mesh.stiffness.k2),
        "damping.d1": float(mesh.damping.d1),
        "damping.d2": float(mesh.damping.d2),
        "damping.d3": float(mesh.damping.d3),
        "backlash.play": float(mesh.backlash.play),
        "inertia": float(drive.train_1.inertia),
        "table_friction.coulomb": float(drive.table_friction.coulomb),
        "table_friction.viscous": float(drive.table_friction.viscous),
        "friction.coulomb": float(drive.train_1.friction.coulomb),
        "friction.viscous": float(drive.train_1.friction.viscous),
    }


def _curve(
    clean: LoadSurfaceFit, scattered: LoadSurfaceFit, profiles: ProfileResult, names: tuple[str, ...]
) -> dict[str, Any]:
    """Printed values found again; with scatter also the profile's intervals, null where the points set no limit."""
    found = {name: float(clean.result[name].value) for name in names}
    return {
        **found,
        "error_percent": clean.error_percent,
        "with_4_percent_scatter": {
            **{
                name: {
                    **scattered.result[name]._asdict(),
                    "interval_95": [
                        None if none else end
                        for end, none in zip(profiles[name].interval, profiles[name].open, strict=True)
                    ],
                }
                for name in names
            },
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


def _swarm(sweeps: SweepStudy) -> dict[str, Any]:
    forces, totals = sweeps.exact.fitted_totals()
    found = {name: swarm_price(getattr(sweeps.exact, name), forces, totals[name]) for name in totals}
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
