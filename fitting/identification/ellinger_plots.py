"""The pictures of the reproduction of Ellinger and Zaeh."""

from pathlib import Path
from typing import TYPE_CHECKING

from fitting.identification.ellinger_study import DISTURBED_MODEL, Case, deviations
from fitting.identification.ellinger_summary import DAMPINGS, STIFFNESSES
from fitting.identification.machine_sensitivity import DAMPING, SHAPE, MachineSensitivity
from fitting.identification.machine_study import VALIDATION, response
from fitting.plots import save_figure
from fitting.plots_machine import plot_conformity, plot_deviations, plot_part_runs
from sensitivity.plots import plot_heat_map, plot_indices
from twin._axes import grid_or_new
from twin.paths import get_leaf
from twin.structure.reference_quantities import UNKNOWN

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.axes import Axes

NAMES = {quantity.path: quantity.name for quantity in UNKNOWN}
"""Names of the unknowns, by path."""
_LINEAR = (105.0, 220.0)


def draw_all(out: Path, ideal: Case, disturbed: Case) -> None:
    """Draw figures 2 and 5 to 9, and the total effects of all parameters.

    Args:
        out: folder for the pictures.
        ideal: ideal model.
        disturbed: disturbed model.
    """
    save_figure(draw_runs(ideal).figure, out / "fig2_runs.png")
    save_figure(draw_ranking(ideal.guided.sensitivity)[0].figure, out / "fig5_sensitivity.png")
    for kind, name in ((SHAPE, "macxp"), (DAMPING, "ndd")):
        save_figure(draw_effects(ideal.guided.sensitivity, kind).figure, out / f"effects_{name}.png")
    for case, (histogram, frf) in ((ideal, (6, 7)), (disturbed, (8, 9))):
        save_figure(draw_deviations(case)[0].figure, out / f"fig{histogram}_deviations.png")
        save_figure(draw_responses(case).figure, out / f"fig{frf}_response.png")


def draw_runs(case: Case, name: str = "ME1 k_z", ax: "Axes | None" = None) -> "Axes":
    """Figure 2 on the runs of one stiffness.

    Args:
        case: the case.
        name: the stiffness.
        ax: axes to draw in; new ones if not given.
    """
    path = next(path for path, short in NAMES.items() if short == name)
    truth = float(get_leaf(case.truth, path))
    return plot_part_runs(case.guided.chosen.selection, path, truth=truth, name=name, ax=ax)


def draw_ranking(sensitivity: MachineSensitivity) -> "np.ndarray":
    """Figure 5: Sobol indices for MACXP of mode 8 at z3 and for NDD² of mode 3 at z2.

    Args:
        sensitivity: Sobol study.
    """
    axes = grid_or_new(None, 2, panel=(4.6, 3.4))
    for ax, output in zip(axes, (f"{SHAPE} mode 8 at +135 mm", f"{DAMPING} mode 3 at -60 mm"), strict=True):
        plot_indices(sensitivity.indices, output, threshold=0.01, names=NAMES, ax=ax)
    return axes


def draw_effects(sensitivity: MachineSensitivity, kind: str) -> "Axes":
    """Total effects of all parameters on all modes at all positions, as a heat map.

    Args:
        sensitivity: Sobol study.
        kind: "MACXP" or "NDD²".
    """
    blocks: dict[str, list[str]] = {}
    for problem in sensitivity.problems:
        blocks.setdefault(f"z = {problem.split(' at ')[1]}", []).append(f"{kind} {problem}")
    ax = plot_heat_map(sensitivity.indices, blocks, names=NAMES)
    ax.set_xlabel("mode")
    ax.set_title(f"{kind} of each mode", pad=22)
    return ax


def draw_deviations(case: Case) -> "np.ndarray":
    """Figures 6 and 8: deviations of stiffnesses and dampings; upper row as published, lower row after the joint fit.

    Args:
        case: the case.
    """
    axes = grid_or_new(None, 4, columns=2, panel=(4.4, 2.8))
    machines = {"published procedure": case.machines["published"], "then joint fit": case.machines["refined"]}
    found = {label: deviations(machine, case.truth) for label, machine in machines.items()}
    for column, (kind, names) in enumerate((("stiffness", STIFFNESSES), ("damping", DAMPINGS))):
        # One scale for both rows: what the joint fit mends is seen.
        both = [deviation[name] for deviation in found.values() for name in names]
        limits = (min(both), max(both))
        for row, (label, deviation) in enumerate(found.items()):
            ax = axes[2 * row + column]
            plot_deviations({name: deviation[name] for name in names}, limits=limits, ax=ax)
            ax.set_title(f"{kind}, {label}", fontsize="medium")
    axes[0].figure.suptitle(_title(case))
    return axes


def draw_responses(case: Case) -> "Axes":
    """Figures 7 and 9: response of the workpiece table in x at the position held back.

    Args:
        case: the case.
    """
    machines = {**case.machines, "dampings permuted": case.permuted()}
    shown = ("published", "refined", "dampings permuted")
    models = {name: response(machines[name], VALIDATION[0]) for name in shown}
    reference = response(case.truth, VALIDATION[0])
    ax = plot_conformity(reference, models, "N6 x", "N6 x", linear=_LINEAR)
    ax.set_title(f"{_title(case)}; workpiece table at z = {1e3 * VALIDATION[0]:.0f} mm", fontsize="medium")
    return ax


def _title(case: Case) -> str:
    model = "disturbed model" if case.name == DISTURBED_MODEL else "ideal model"
    return f"{model} against simulated data"
