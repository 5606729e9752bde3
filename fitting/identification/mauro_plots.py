"""The pictures of the reproduction of Mauro et al."""

from pathlib import Path
from typing import TYPE_CHECKING

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.identification.mauro_design import DesignStudy
from fitting.identification.mauro_structure import Structure
from fitting.identification.mauro_study import TableStudy
from fitting.identification.mauro_table import OPTIMAL_GAIN, REPEATED_GAIN, mauro_table
from fitting.plots import save_figure
from fitting.plots_axis import plot_closed_loop, plot_spring_deformations, plot_time_response
from fitting.plots_design import plot_trade_off
from twin._axes import axes_or_new, grid_or_new
from twin.control import closed_loop_response
from twin.drives import BallScrewAxis, spring_deformations
from twin.io.units import to_si
from twin.laws import ViscousFriction
from twin.performance import PositioningCycle, PositioningPerformance, positioning_cost
from twin.plots import plot_sweep
from twin.trajectory import Trajectory

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes


def draw_all(out: Path, structure: Structure, study: TableStudy, design: DesignStudy) -> None:
    """Draw figures 6 to 11 and the residuals of Table 1.

    Args:
        out: folder for the pictures.
        structure: modal analysis.
        study: the twin behind Table 1.
        design: gains found by gradients.
    """
    twin = study.fit.model
    save_figure(plot_friction(twin.six_degrees()).figure, out / "fig6_friction.png")
    frequency = np.geomspace(1, 1000, 400)
    axes = None
    for rigid, label in ((False, "six degrees of freedom"), (True, "rigid axis")):
        loop = twin.cycle(to_si(OPTIMAL_GAIN, "1/min", "1/s"), rigid=rigid).loop
        # In motion the friction only damps; at rest it would hold an axis that is asked for so little.
        moving = eqx.tree_at(lambda loop: loop.plant.friction, loop, ViscousFriction(twin.viscous))
        response = closed_loop_response(moving, frequency)
        axes = plot_closed_loop(response, label=label, axes=axes)
    assert axes is not None
    save_figure(axes[0].figure, out / "fig7_closed_loop.png")
    cycle = twin.cycle(to_si(OPTIMAL_GAIN, "1/min", "1/s"), rigid=False)
    save_figure(plot_time_response(_simulated(cycle), cycle.move)[0].figure, out / "fig8_time_response.png")
    save_figure(plot_spring_deformations(spring_deformations(structure.axis)).figure, out / "fig9_deformations.png")
    ax = plot_sweep(structure.support_sweep)
    ax.set_xlabel("stiffness of the support k₀ / chosen value [-]")
    ax.set_ylabel("first natural frequency [Hz]")
    save_figure(ax.figure, out / "fig10_support.png")
    save_figure(plot_table(study.rows)[0].figure, out / "fig11_gain.png")
    save_figure(plot_table_residuals(study.rows)[0].figure, out / "table1_residuals.png")
    save_figure(plot_trade_off(design.compromises).figure, out / "trade_off.png")


def plot_friction(axis: BallScrewAxis, *, speeds: np.ndarray | None = None, ax: "Axes | None" = None) -> "Axes":
    """Friction torque of an axis over the speed of its screw, in steady motion (Mauro et al., fig. 6).

    Args:
        axis: ball screw axis; friction with or without memory.
        speeds: speeds [rad/s]; up to 400 if not given.
        ax: axes to draw in; new ones if not given.
    """
    ax = axes_or_new(ax)
    omega = np.linspace(-400, 400, 801) if speeds is None else np.asarray(speeds)
    law = axis.friction
    # In steady sliding the contact has turned fully into the direction of motion.
    state = jax.tree.map(lambda z: jnp.broadcast_to(jnp.sign(omega), omega.shape) + 0 * z, law.initial_state())
    ax.plot(omega * 60 / (2 * np.pi), np.asarray(law.force(state, jnp.asarray(omega), jnp.zeros_like(omega))))
    ax.set_xlabel("speed of the screw [1/min]")
    ax.set_ylabel("friction torque [Nm]")
    return ax


def plot_table(rows: PositioningPerformance, *, axes: "Sequence[Axes] | np.ndarray | None" = None) -> "np.ndarray":
    """Static error, energy, response time and cost over the gain, as printed and simulated (fig. 11, Table 1).

    Args:
        rows: of the 20 gains.
        axes: four axes to draw in; new ones if not given.
    """
    table = mauro_table()
    axes = grid_or_new(axes, 4, columns=1, panel=(7.0, 2.2))
    columns = (
        ("static error [µm]", table.error, 1e6 * np.abs(np.asarray(rows.error))),
        ("energy [kJ/cycle]", table.energy, 1e-3 * np.asarray(rows.energy)),
        ("response time [s]", table.time, np.asarray(rows.time)),
        ("cost C [-]", table.cost, np.asarray(positioning_cost(*rows))),
    )
    for ax, (label, printed, simulated) in zip(axes, columns, strict=True):
        ax.plot(table.gain, printed, "o", ms=4, label="Table 1")
        ax.plot(table.gain, simulated, "-", label="twin")
        ax.set_ylabel(label)
    axes[0].legend()
    axes[-1].set_xlabel("position gain k_v [1/min]")
    return axes


def plot_table_residuals(
    rows: PositioningPerformance, *, axes: "Sequence[Axes] | np.ndarray | None" = None
) -> "np.ndarray":
    """What the twin deviates from Table 1, row by row; the misprinted row's time and energy are hollow.

    Args:
        rows: of the 20 gains.
        axes: three axes to draw in; new ones if not given.
    """
    table = mauro_table()
    axes = grid_or_new(axes, 3, columns=1, panel=(7.0, 2.2))
    columns = (
        ("error: twin - table [µm]", 1e6 * np.abs(np.asarray(rows.error)) - table.error),
        ("energy: twin / table - 1 [%]", 100 * (np.asarray(rows.energy) / (1e3 * table.energy) - 1)),
        ("time: twin / table - 1 [%]", 100 * (np.asarray(rows.time) / table.time - 1)),
    )
    misprint = table.gain == REPEATED_GAIN
    for i, (ax, (label, values)) in enumerate(zip(axes, columns, strict=True)):
        filled = np.full(misprint.shape, True) if i == 0 else ~misprint
        ax.axhline(0.0, color="0.7", lw=0.8)
        ax.plot(table.gain[filled], values[filled], "o", color="C0")
        ax.plot(table.gain[~filled], values[~filled], "o", mfc="none", color="C0")
        ax.set_ylabel(label)
    axes[-1].set_xlabel("position gain k_v [1/min]")
    return axes


@eqx.filter_jit
def _simulated(cycle: PositioningCycle) -> Trajectory:
    return cycle.simulate()
