"""Picture of friction over speed: measured points with their errors, and laws through them."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from fitting.identification.friction_curve import FrictionCurve
from twin._axes import axes_or_new
from twin.laws import AbstractStaticFriction

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_RPM = 60 / (2 * np.pi)


def plot_friction_curve(
    curve: FrictionCurve,
    laws: "Mapping[str, AbstractStaticFriction] | None" = None,
    *,
    ax: "Axes | None" = None,
) -> "Axes":
    """Friction torque over speed, as Mauro et al., fig. 6.

    Args:
        curve: measured points; their bars are two standard errors to both sides.
        laws: laws to draw, by name.
        ax: axes to draw in; new ones if not given.
    """
    ax = axes_or_new(ax, (7.0, 3.8))
    reach = 1.05 * float(np.max(np.abs(curve.speeds)))
    low = -reach if np.any(curve.speeds < 0) else 0.0
    high = reach if np.any(curve.speeds > 0) else 0.0
    # Fine near zero, where the torque turns.
    side = np.concatenate([[0.0], np.geomspace(1e-5 * reach, reach, 600)])
    speed = np.concatenate([-side[:0:-1], side])
    speed = speed[(speed >= low) & (speed <= high)]
    for i, (name, law) in enumerate((laws or {}).items()):
        ax.plot(_RPM * speed, np.asarray(law(speed)), color=f"C{i}", lw=1.3, label=name)
    ax.errorbar(
        _RPM * curve.speeds,
        curve.torques,
        yerr=2 * curve.standard_errors,
        fmt="ko",
        ms=3.5,
        lw=1.0,
        capsize=2.5,
        label="measured, ±2 standard errors",
        zorder=3,
    )
    ax.axhline(0.0, color="0.8", lw=0.8, zorder=0)
    ax.axvline(0.0, color="0.8", lw=0.8, zorder=0)
    ax.set_xlim(_RPM * low, _RPM * high)
    ax.set_xlabel("speed [1/min]")
    ax.set_ylabel("friction torque [N m]")
    ax.legend(loc="lower right", fontsize="small")
    return ax
