"""`drivetwin simulate`: what the model of a study does."""

from pathlib import Path
from typing import Any

import numpy as np

from fitting.commands._outcome import Outcome
from fitting.report.content import Figure, Section
from fitting.study.evidence import simulated, status_of
from fitting.study.motion import Motion, read_motion
from fitting.study.run_report import write_run_report
from fitting.study.study_file import StudyFile
from fitting.study.units_of_outputs import output_units
from fitting.study.written import write_run
from twin.export.trajectory import write_trajectory


def run_simulate(study: StudyFile, out: Path) -> Outcome:
    """Simulate, and write `trajectory.csv`, `trajectory.h5`, `simulation.png` and `summary.json`.

    Args:
        study: the study.
        out: folder for the results.

    Raises:
        InputError: see `read_motion`.
    """
    motion = read_motion(study)
    trajectory = simulated(motion.model, motion.reference, motion.times, study.stepping)
    problem = status_of(trajectory)
    units = output_units(study)
    channels = {name: np.asarray(trajectory.channel(name)) for name in trajectory.outputs._fields}
    known = {name: unit for name, unit in units.items() if unit}
    for name in () if problem else ("trajectory.csv", "trajectory.h5"):
        write_trajectory(out / name, trajectory, units=known)
    moving = [name for name, values in channels.items() if np.ptp(values) > 0] or list(channels)
    _draw(out / "simulation.png", study.title, moving, motion, channels, units)
    ranges = {
        name: {"unit": units[name], "min": float(values.min()), "max": float(values.max()), "last": float(values[-1])}
        for name, values in channels.items()
    }
    summary = {"status": problem or "successful", "samples": len(motion.times), "channels": ranges}
    write_run(study, out, "simulate", summary)
    figure = Figure(
        lambda axes: _panels(axes, moving, motion, channels, units),
        f"Simulated {', '.join(moving)} over time.",
        panels=len(moving),
        wide=True,
        height=1.5,
    )
    report = write_run_report(
        study,
        out,
        f"{len(motion.times)} samples of the model in motion.",
        [Section("Simulation", figures=(figure,))],
        warnings=[problem] if problem else [],
    )
    lines = [f"{name:18} {one['min']:12.5g} to {one['max']:<12.5g} {one['unit']}" for name, one in ranges.items()]
    text = "\n".join([f"{study.title}: {len(motion.times)} samples", *lines, problem, f"Report: {report}"])
    return Outcome(text.replace("\n\n", "\n"), summary, code=1 if problem else 0)


def _draw(
    file: Path, title: str, moving: list[str], motion: Motion, channels: dict[str, np.ndarray], units: dict[str, str]
) -> None:
    from matplotlib import pyplot

    from fitting.plots import save_figure

    figure, axes = pyplot.subplots(
        len(moving), 1, figsize=(8, 1.2 + 1.5 * len(moving)), layout="constrained", sharex=True, squeeze=False
    )
    _panels(axes[:, 0], moving, motion, channels, units)
    axes[0, 0].set_title(title)
    save_figure(figure, file)


def _panels(
    axes: Any, names: list[str], motion: Motion, channels: dict[str, np.ndarray], units: dict[str, str]
) -> None:
    for ax, name in zip(axes, names, strict=True):
        if name in motion.measured:
            ax.plot(motion.times, motion.measured[name], color="0.6", label="measured")
        ax.plot(motion.times, channels[name], lw=1, label="simulated")
        unit = f"\n[{units[name]}]" if units[name] else ""
        ax.set_ylabel(f"{name.replace('_', ' ')}{unit}")
        ax.margins(x=0)
        if name in motion.measured:
            ax.legend(frameon=False, fontsize="small")
    axes[-1].set_xlabel("time [s]")
