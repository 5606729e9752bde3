"""From sweeps at several preloads to the load-dependent stiffness and damping of a drive train: the published chain."""

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np

from fitting.identification.load_surface import LoadSurfaceFit, fit_hyperbolic_damping, fit_root_stiffness
from fitting.identification.peak_picking import NoCrossing, Peak, check_estimator, pick_peak
from fitting.identification.preload_sweep import PreloadSweep
from twin._checks import InputError
from twin.drives import RackPinionDrive
from twin.frf import FRF

if TYPE_CHECKING:
    import pandas as pd


@dataclasses.dataclass(frozen=True)
class ChainPoint:
    """What one sweep tells."""

    preload_percent: float
    """Preload in per cent of the rated torque."""
    forces: tuple[float, float]
    """Mean motor forces 2·i_g/d_p·τ during the sweep [N]."""
    response: FRF
    """Response V_T/V_1."""
    peak: Peak | None
    """Total stiffness and damping; None where the response has no -90° point."""
    used: bool
    """Whether the curves are fitted to it."""


@dataclasses.dataclass(frozen=True)
class PreloadChain:
    """Total stiffness and damping at each preload, and the laws of one drive train fitted to them."""

    points: tuple[ChainPoint, ...]
    """One for each sweep."""
    estimator: str
    """How the peaks were read, "paper" or "exact"."""
    stiffness: LoadSurfaceFit
    """k(F), eq. 3 to 6."""
    damping: LoadSurfaceFit
    """d(F), eq. 7 to 10."""

    def fitted_totals(self) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Motor forces (2, points) [N] and the totals at them, by the name of the law that is fitted to them."""
        used = [point for point in self.points if point.used and point.peak is not None]
        forces = np.asarray([point.forces for point in used]).T
        totals = {name: np.asarray([getattr(point.peak, name) for point in used]) for name in ("stiffness", "damping")}
        return forces, totals

    def to_dataframe(self) -> "pd.DataFrame":
        """One row for each sweep: preload, forces, natural frequency, magnitude, stiffness, damping."""
        import pandas as pd

        rows = []
        for point in self.points:
            peak = point.peak or Peak(*(np.nan,) * 5)
            rows.append(
                {
                    "preload [%]": point.preload_percent,
                    "F1 [N]": point.forces[0],
                    "F2 [N]": point.forces[1],
                    "f0 [Hz]": peak.frequency,
                    "|G| [-]": peak.magnitude,
                    "k [N/m]": peak.stiffness,
                    "d [N s/m]": peak.damping,
                    "D [-]": peak.damping_ratio,
                    "used": point.used,
                }
            )
        return pd.DataFrame(rows).set_index("preload [%]")


def identify_preload_chain(
    sweeps: Sequence[PreloadSweep],
    drive: RackPinionDrive,
    *,
    estimator: str = "exact",
    band: tuple[float, float] = (30.0, 200.0),
    leave_out_up_to: float = 6.0,
    guide_damping: float = 0.0,
    sample_rate: float = 1000.0,
    responses: Sequence[FRF] | None = None,
) -> PreloadChain:
    """k(F) and d(F) of one drive train from sweeps at several preloads (Leipe et al., section V).

    Each sweep gives a response by H3, its -90° point the total stiffness and damping, the mean torques the forces; the
    laws of eq. 3 and 8 are fitted to the totals, with both drive trains alike.

    Args:
        sweeps: one record for each preload.
        drive: the drive, of which mass, gear ratio and pinion diameter are used.
        estimator: how peaks are read, see `pick_peak`.
        band: where the peaks are looked for [Hz].
        leave_out_up_to: preloads up to this one are shown but not fitted, as backlash distorts them [%].
        guide_damping: slope of the table's friction for "exact" [Ns/m].
        sample_rate: rate at which velocities are formed, see `PreloadSweep.velocities` [Hz].
        responses: responses of the sweeps where they are known already; estimated if not given.

    Raises:
        InputError: no -90° point of a sweep that is to be fitted, too few sweeps left, responses that are not one for
            each sweep.
    """
    if responses is not None and len(responses) != len(sweeps):
        raise InputError(f"{len(sweeps)} sweeps and {len(responses)} responses were given. Give one response for each.")
    check_estimator(estimator)
    mass = float(drive.table_mass)
    found = []
    for i, sweep in enumerate(sweeps):
        response = sweep.response(sample_rate=sample_rate, band=band) if responses is None else responses[i]
        used = abs(sweep.preload_percent) > leave_out_up_to
        try:
            peak = pick_peak(
                response.frequency,
                response.values[0, 0],
                mass,
                estimator=estimator,
                guide_damping=guide_damping,
                band=band,
            )
        except NoCrossing as error:
            if used:
                raise InputError(f"At {sweep.preload_percent:g} % preload: {error}") from error
            peak = None
        forces = drive.motor_force(sweep.motor_torques())
        found.append(ChainPoint(sweep.preload_percent, (float(forces[0]), float(forces[1])), response, peak, used))
    fitted = [point for point in found if point.used and point.peak is not None]
    if len(fitted) < 3:
        raise InputError(
            f"{len(fitted)} of {len(found)} sweeps have a preload above {leave_out_up_to:g} %; the damping law has "
            "three parameters. Measure at more preloads, or lower leave_out_up_to."
        )
    forces = jnp.asarray([point.forces for point in fitted]).T
    stiffness = fit_root_stiffness(forces, np.asarray([point.peak.stiffness for point in fitted if point.peak]))
    damping = fit_hyperbolic_damping(forces, np.asarray([point.peak.damping for point in fitted if point.peak]))
    return PreloadChain(tuple(found), estimator, stiffness, damping)
