"""The pictures of the reproduction of Leipe et al."""

from collections.abc import Mapping
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from fitting.identification.leipe import (
    RATED_TORQUE,
    CurveFits,
    DirectStudy,
    SweepStudy,
    Validation,
    choose_preloads,
)
from fitting.identification.leipe_bench import bench_drive
from fitting.identification.leipe_reconstruction import Reconstruction, reconstruct
from fitting.plots import plot_comparison, save_figure
from fitting.plots_rack_pinion import plain_ticks, plot_load_surface, plot_preload_responses, plot_quadrants
from twin._axes import grid_or_new
from twin.drives import RackPinionDrive


def draw_all(out: Path, curves: CurveFits, sweeps: SweepStudy, direct: DirectStudy, validation: Validation) -> None:
    """Draw figures 4 to 8, the direct fits and the outlook.

    Args:
        out: folder for the pictures.
        curves: fits to the printed laws.
        sweeps: sweeps and chain.
        direct: direct fits.
        validation: the validation move.
    """
    save_figure(plot_preload_responses(sweeps.exact.points)[0].figure, out / "fig4_responses.png")
    quadrants = plot_quadrants(bench_drive().train_1.mesh.stiffness, direct.moves[0].forces)
    save_figure(quadrants.figure, out / "fig5_quadrants.png")
    forces, totals = sweeps.exact.fitted_totals()
    for figure, name, unit, scale in (
        ("fig6_stiffness", "stiffness", "N/µm", 1e6),
        ("fig7_damping", "damping", "kNs/m", 1e3),
    ):
        found = getattr(sweeps.exact, name)
        surface = plot_load_surface(found, forces, totals[name], label=f"total {name} [{unit}]", scale=scale)
        save_figure(surface.figure, out / f"{figure}.png")
    save_figure(plot_validation(validation)[0].figure, out / "fig8_validation.png")
    save_figure(plot_curve_errors(sweeps, direct)[0].figure, out / "curves.png")
    save_figure(plot_preload_choice(validation.drive)[0].figure, out / "preload_choice.png")
    save_figure(plot_reconstruction(reconstruct(direct, validation))[0].figure, out / "reconstruction.png")


def plot_validation(validation: Validation) -> "np.ndarray":
    """Set position and both torques of the validation move, measured and simulated (Leipe et al., fig. 8).

    Args:
        validation: the validation move.
    """
    from matplotlib import pyplot

    _, axes = pyplot.subplots(3, 1, figsize=(7.0, 6.4), layout="constrained", sharex=True)
    record = validation.measurement.record
    motion = jax.vmap(validation.reference)(record.times)
    axes[0].plot(record.times, motion.position, color="C2")
    axes[0].set_ylabel("x_d [m]")
    for i, ax in ((1, axes[1]), (2, axes[2])):
        name = f"torque_{i}"
        plot_comparison(
            record.times,
            record.channel(name),
            validation.simulated.channel(name),
            label=f"torque τ_{i}",
            unit="Nm",
            ax=ax,
        )
        error = validation.mean_absolute_errors[i - 1]
        ax.set_title(f"mean absolute error {error:.3f} Nm", fontsize="medium", loc="left")
    axes[1].set_xlabel("")
    return axes


def plot_curve_errors(sweeps: SweepStudy, direct: DirectStudy) -> "np.ndarray":
    """k(F) and d(F) of one drive train from every procedure, as errors against the truth.

    Args:
        sweeps: sweeps and chain.
        direct: direct fits.
    """
    from matplotlib import pyplot

    _, axes = pyplot.subplots(2, 1, figsize=(7.0, 5.4), layout="constrained", sharex=True)
    force = np.geomspace(250.0, 5000.0, 80)
    truth = bench_drive().train_1.mesh
    found = {
        "chain, paper": (sweeps.paper.stiffness.law, sweeps.paper.damping.law),
        "chain, exact": (sweeps.exact.stiffness.law, sweeps.exact.damping.law),
        **{
            f"direct, {label}": (
                getattr(direct.fits, name).model.drive.train_1.mesh.stiffness,
                getattr(direct.fits, name).model.drive.train_1.mesh.damping,
            )
            for name, label in (("frf", "responses"), ("time", "motions"), ("joint", "both"))
        },
    }
    for label, laws in found.items():
        for ax, law, true in zip(axes, laws, (truth.stiffness, truth.damping), strict=True):
            ax.plot(force, 100 * (np.asarray(law(jnp.asarray(force))) / np.asarray(true(force)) - 1), label=label)
    for ax, name in zip(axes, ("k(F)", "d(F)"), strict=True):
        ax.axhline(0.0, color="0.4", lw=0.8)
        ax.set_ylabel(f"error of {name} [%]")
        ax.set_xscale("log")
        ax.margins(x=0)
    axes[0].legend(fontsize="small", ncols=2)
    plain_ticks(axes[1], [250, 500, 1000, 2000, 5000])
    axes[1].set_xlabel("force through the mesh [N]")
    return axes


def plot_preload_choice(drive: RackPinionDrive) -> "np.ndarray":
    """The preload that a stiffness needs, and its copper loss, over the process force.

    Args:
        drive: the drive.
    """
    from matplotlib import pyplot

    _, axes = pyplot.subplots(1, 2, figsize=(8.4, 3.4), layout="constrained")
    loads = np.linspace(-2500.0, 2500.0, 21)
    for wanted in (1.1e8, 1.3e8, 1.5e8):
        chosen = choose_preloads(drive, wanted, loads.tolist())
        label = f"{wanted / 1e6:g} N/µm"
        axes[0].plot(loads / 1e3, [100 * float(c.preload) / RATED_TORQUE for c in chosen], label=label)
        axes[1].plot(loads / 1e3, [float(c.extra_loss) for c in chosen], label=label)
    axes[0].set_ylabel("preload [% of rated torque]")
    axes[1].set_ylabel("copper loss of the preload [W]")
    for ax in axes:
        ax.set_xlabel("process force [kN]")
        ax.margins(x=0)
    axes[0].legend(title="total stiffness", fontsize="small")
    return axes


def plot_reconstruction(found: Mapping[str, Reconstruction]) -> "np.ndarray":
    """Errors of the table position made from the motor encoders, over time.

    Args:
        found: reconstructions by name.
    """
    grid = grid_or_new(None, len(found), columns=1, panel=(7.0, 2.4))
    for ax, (name, one) in zip(grid, found.items(), strict=True):
        for i, (label, error) in enumerate(one.errors.items()):
            ax.plot(one.times, 1e6 * error, color=f"C{i}", lw=1.0, label=label)
        ax.axhline(0.0, color="0.4", lw=0.8, zorder=0)
        ax.set_title(name, fontsize="medium", loc="left")
        ax.set_ylabel("error of x_T [µm]")
        ax.margins(x=0)
    grid[0].legend(fontsize="small", ncols=3, loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False)
    grid[-1].set_xlabel("time [s]")
    return grid
