"""`drivetwin rank`: which free parameters matter for which output, over their bounds.

[rank]
outputs = ["rms_error(position)", "max(command)"]
method = "sobol"             # or "morris", "derivative"
samples = 256
"""

from pathlib import Path
from typing import Any, cast

import numpy as np

from fitting.commands._outcome import Outcome
from fitting.report.content import Cell, Section, Table
from fitting.report.ranking import ranking_section
from fitting.study.asked_outputs import asked_outputs
from fitting.study.run_report import write_run_report
from fitting.study.study_file import StudyFile
from fitting.study.written import write_run
from twin._checks import InputError


def run_rank(study: StudyFile, out: Path) -> Outcome:
    """Compute the sensitivities, and write `sensitivity.csv`, `sensitivity.png`, `summary.json`.

    Args:
        study: the study.
        out: folder for the results; what is computed is kept in `store` there.

    Raises:
        InputError: naming line and key: an unknown output, bounds missing, samples no power of two.
    """
    table = study.table("rank", known=("outputs", "method", "samples"), required=True)
    method = table.text("method", "sobol", choices=("sobol", "morris", "derivative"))
    outputs = asked_outputs(study, table)
    options = {"seed": study.seed, "model": outputs.model, "store": out / "store"}
    try:
        from sensitivity import derivative_measures, morris, sobol

        if method == "sobol":
            found = sobol(outputs.function, study.space, n=table.integer("samples", 256), **options)
            values, measure = found.ST, "total effect S_T [-]"
        elif method == "morris":
            found = morris(outputs.function, study.space, trajectories=table.integer("samples", 64), **options)
            values, measure = found.mu_star, "mean absolute effect [unit of the output]"
        else:
            found = derivative_measures(outputs.function, study.space, n=table.integer("samples", 256), **options)
            values, measure = found.bound, "upper bound of the total effect [-]"
    except InputError as error:
        raise table.error("", str(error)) from error
    frame = found.to_dataframe()
    frame.to_csv(out / "sensitivity.csv", index=False)
    by_output = {
        name: dict(sorted(zip(study.space.paths, np.asarray(row).tolist(), strict=True), key=lambda pair: -pair[1]))
        for name, row in zip(found.outputs, values, strict=True)
    }
    _draw(out / "sensitivity.png", by_output, study.title, measure)
    summary = {"method": method, "measure": measure, "ranking": by_output}
    write_run(study, out, "rank", summary)
    section = _effects(found, measure) if method == "morris" else ranking_section(cast(Any, found))
    task = f"Which of {len(study.space)} parameters move {', '.join(by_output)}?"
    report = write_run_report(study, out, task, [section], space=study.space)
    lines = []
    for name, ranked in by_output.items():
        lines += [f"{name}: {measure}", *(f"  {path:40} {value:10.4g}" for path, value in ranked.items())]
    return Outcome("\n".join([study.title, *lines, f"Report: {report}"]), summary)


def _effects(found: Any, measure: str) -> Section:
    """Elementary effects as a table; they have units and are no shares."""
    rows = []
    for i, path in enumerate(found.names):
        numbers = [
            Cell(f"{found.mu_star[j, i]:.3g} ± {found.mu_star_conf[j, i]:.2g}") for j in range(len(found.outputs))
        ]
        rows.append((Cell(path, "name"), *numbers))
    return Section("Sensitivity", f"Elementary effects: {measure}.", tables=(Table(("", *found.outputs), tuple(rows)),))


def _draw(file: Path, by_output: dict[str, dict[str, float]], title: str, measure: str) -> None:
    from matplotlib import pyplot

    from fitting.plots import save_figure

    paths = list(next(iter(by_output.values())))
    figure, axes = pyplot.subplots(
        1,
        len(by_output),
        figsize=(2.5 + 3 * len(by_output), 1.2 + 0.32 * len(paths)),
        layout="constrained",
        sharey=True,
        squeeze=False,
    )
    for ax, (name, ranked) in zip(axes[0], by_output.items(), strict=True):
        ax.barh(range(len(paths)), [ranked[path] for path in paths], color="C0")
        ax.set_title(name, fontsize="medium")
        ax.set_xlabel(measure.replace(" [", "\n["))
    axes[0, 0].set_yticks(range(len(paths)), paths)
    axes[0, 0].invert_yaxis()
    figure.suptitle(title)
    save_figure(figure, file)
