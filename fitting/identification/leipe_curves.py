"""The curve fits of Leipe et al., section V, to points made from the printed laws."""

import dataclasses

import numpy as np

from fitting.identification.load_surface import LoadSurfaceFit, fit_hyperbolic_damping, fit_root_stiffness
from fitting.profile import ProfileResult, profile
from fitting.residuals.load_surface import LoadSurfaceResidual, total_over_contacts
from twin.drives import leipe_drive
from twin.drives.leipe import DAMPING, RATED_TORQUE, STIFFNESS
from twin.laws import HyperbolicDamping, RootStiffness


@dataclasses.dataclass(frozen=True)
class CurveFits:
    """The laws fitted to totals made from the published ones (eq. 6, 10)."""

    clean: tuple[LoadSurfaceFit, LoadSurfaceFit]
    """Stiffness and damping from points as they are."""
    scattered: tuple[LoadSurfaceFit, LoadSurfaceFit]
    """From points with a scatter of 4 % rms."""
    forces: np.ndarray
    """Motor forces of the points (2, points) [N]."""
    totals: tuple[np.ndarray, np.ndarray]
    """Stiffnesses and dampings of the scattered points [N/m, Ns/m]."""


def fit_printed_curves(scatter: float = 0.04, seed: int = 1) -> CurveFits:
    """The curve fits of section V to points from the printed laws, without and with scatter.

    Args:
        scatter: rms of the scatter relative to the rms of the totals.
        seed: of the scatter.
    """
    drive = leipe_drive()
    preload = RATED_TORQUE * np.linspace(0.08, 1.0, 24)
    # Near the angle bisector: what moves the table adds to one force and takes from the other.
    forces = np.asarray(drive.motor_force(np.stack([preload + 0.3, preload - 0.3])))
    random = np.random.default_rng(seed)
    clean, scattered, totals = [], [], []
    laws = (RootStiffness(*STIFFNESS), HyperbolicDamping(*DAMPING))
    for law, identify in zip(laws, (fit_root_stiffness, fit_hyperbolic_damping), strict=True):
        total = np.asarray(total_over_contacts(law, forces))
        noise = random.standard_normal(total.size)
        measured = total + scatter * noise * np.linalg.norm(total) / np.linalg.norm(noise)
        clean.append(identify(forces, total))
        scattered.append(identify(forces, measured))
        totals.append(measured)
    return CurveFits((clean[0], clean[1]), (scattered[0], scattered[1]), forces, (totals[0], totals[1]))


def profile_curves(curves: CurveFits) -> tuple[ProfileResult, ProfileResult]:
    """Intervals of the scattered fits that need no linear theory: the totals hardly see where d(F) bends.

    Args:
        curves: of `fit_printed_curves`.
    """
    found = []
    for fit, measured in zip(curves.scattered, curves.totals, strict=True):
        evidence = LoadSurfaceResidual(curves.forces, measured, float(np.sqrt(np.mean(measured**2))))
        found.append(profile(evidence, fit.result, rounds=15))
    return found[0], found[1]
