"""The report of a fitted study, and its pictures as files."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting.report.asked import Asked
from fitting.report.fit_report import fit_report
from fitting.report.page import write_report
from fitting.study.derived import derived_of
from fitting.study.free_parameters import free_text
from fitting.study.study_file import StudyFile
from fitting.study.units_of_outputs import output_units

if TYPE_CHECKING:
    from fitting.study.fit_run import FitRun


def write_fit_report(
    study: StudyFile, found: "FitRun", out: Path, *, versions: Mapping[str, str]
) -> tuple[Path, tuple[str, ...]]:
    """Write `report.html`, and the pictures of records and intervals as PNG files.

    Args:
        study: the study.
        found: the fit.
        out: folder for the results.
        versions: versions of what computed.

    Returns:
        Path of the report, and the warnings at its head.
    """
    records = {one.name: one.record for one in found.data.records}
    report = fit_report(
        title=study.title,
        asked=Asked(
            text=free_text(found.result.space, [*records, *found.responses], found.held),
            model=type(study.model).__name__,
            study=study.document.text,
            versions=versions,
            settings={"Seed": str(study.seed)},
        ),
        result=found.result,
        records=records,
        simulated=found.simulated,
        deviation={one.name: one.deviation for one in found.data.records},
        responses=found.responses or None,
        identifiability=found.verdicts,
        many=found.many,
        controls=found.controls,
        remarks=_by_data(found),
        warnings=(*found.hints, *found.data.warnings),
        derived=derived_of(found.result),
    )
    _draw(study, found, out)
    return write_report(out / "report.html", report), report.warnings


def _by_data(found: "FitRun") -> dict[str, list[str]]:
    """Remarks by data set, its name taken off."""
    parts = (*found.data.records, *found.data.responses)
    return {one.name: [remark.removeprefix(f"{one.name}: ") for remark in one.remarks] for one in parts}


def _draw(study: StudyFile, found: "FitRun", out: Path) -> None:
    from matplotlib import pyplot

    from fitting.plots import plot_comparison, plot_intervals, save_figure

    units = output_units(study)
    for one in found.data.records:
        channels = list(one.deviation)
        figure, axes = pyplot.subplots(
            2 * len(channels), 1, figsize=(8, 4 * len(channels)), layout="constrained", sharex=True, squeeze=False
        )
        times = np.asarray(one.record.times)
        for i, name in enumerate(channels):
            unit = one.record.units[name] or units.get(name, "")
            measured, simulated = np.asarray(one.record.channel(name)), found.simulated[one.name][name]
            plot_comparison(times, measured, simulated, label=name.replace("_", " "), unit=unit, ax=axes[2 * i, 0])
            axes[2 * i + 1, 0].plot(times, measured - simulated, lw=0.6)
            axes[2 * i + 1, 0].set_ylabel(f"difference\n[{unit}]")
        for ax in axes[:-1, 0]:
            ax.set_xlabel("")
        axes[-1, 0].set_xlabel("time [s]")
        title = f"{study.title}: {one.name}" + (" (held back)" if one.name in found.held else "")
        axes[0, 0].set_title(title, loc="left")
        save_figure(figure, out / f"fit_{one.name}.png")
    ax: Any = plot_intervals(found.result)
    ax.set_title(study.title)
    save_figure(ax.figure, out / "intervals.png")
