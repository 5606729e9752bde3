"""`drivetwin sweep`: what if? Numbers of the model over a grid of its parameters.

[sweep]
outputs = ["max_error(position)", "frequency(1)"]
[sweep.over]
"plant.mass" = { from = "50 kg", to = "200 kg", count = 16 }
"controller.position_gain" = ["80 1/s", "160 1/s"]
"""

from pathlib import Path
from typing import Any

import numpy as np

from fitting.commands._outcome import Outcome
from fitting.report.sweeps import sweep_section
from fitting.study.asked_outputs import asked_outputs, units_of_asked
from fitting.study.run_report import write_run_report
from fitting.study.study_file import StudyFile
from fitting.study.written import write_run
from twin._checks import InputError
from twin.io.model_types import unit_of_leaf
from twin.io.quantity import Quantity, parse_quantity
from twin.io.toml_document import Key, unknown
from twin.io.toml_table import TomlTable
from twin.parameters import Parameter
from twin.paths import get_leaf, leaf_paths
from twin.sweep import sweep
from twin.sweep_result import Sweep


def run_sweep(study: StudyFile, out: Path) -> Outcome:
    """Compute the sweep, and write `sweep.csv`, pictures and `summary.json`; what is computed is kept in `store`.

    Args:
        study: the study.
        out: folder for the results.

    Raises:
        InputError: naming line and key: an unknown path or output, values that are none.
    """
    table = study.table("sweep", known=("outputs", "over", "grid"), required=True)
    over = dict(_axis(study, ("sweep", "over", path)) for path in table.table("over"))
    if not over:
        raise table.error("over", 'names no parameter. Add [sweep.over] with "plant.mass" = ["50 kg", "100 kg"].')
    outputs = asked_outputs(study, table)
    units = units_of_asked(study, outputs)
    model = outputs.model
    try:
        found = sweep(
            model,
            over,
            outputs.function,
            grid=table.flag("grid", True),
            units=units,
            store=out / "store",
        )
    except InputError as error:
        raise table.error("", str(error)) from error
    found.to_dataframe().to_csv(out / "sweep.csv", index=False)
    pictures = _draw(found, out, study.title)
    failed = int(found.failed.sum())
    ranges = {name: _range(values, units.get(name, "")) for name, values in found.results.items()}
    summary = {"points": int(np.prod(found.shape)), "failed": failed, "results": ranges, "pictures": pictures}
    write_run(study, out, "sweep", summary)
    told = (
        [f"{failed} of {summary['points']} points failed; they are empty in the table and crossed out."]
        if failed
        else []
    )
    task = f"How do {', '.join(found.results)} change with {' and '.join(p.path for p in over)}?"
    report = write_run_report(study, out, task, [sweep_section(found)], warnings=told)
    lines = [f"{name:24} {one['min']:12.5g} to {one['max']:<12.5g} {one['unit']}" for name, one in ranges.items()]
    head = f"{study.title}: {summary['points']} points over {', '.join(p.path for p in over)}"
    return Outcome("\n".join([head, *lines, *told, f"Report: {report}"]), summary, code=1 if failed else 0)


def _axis(study: StudyFile, key: Key) -> tuple[Parameter, np.ndarray]:
    path = str(key[-1])
    document = study.document
    try:
        get_leaf(study.model, path)
    except InputError as error:
        raise document.error(key, unknown("path", path, leaf_paths(study.model))) from error
    units = unit_of_leaf(study.model, path)
    written: Any = document.table(key[:-1])[path]
    if isinstance(written, dict):
        table = TomlTable(document, key, ("from", "to", "count", "scale"))
        low, high = table.quantity("from", units=units), table.quantity("to", units=units)
        count = table.integer("count", 11, least=2)
        if table.text("scale", "linear", choices=("linear", "log")) == "log":
            if not (low.value > 0 and high.value > 0):
                raise table.error("scale", "log needs values above zero.")
            return _parameter(path, low, high), np.geomspace(low.value, high.value, count)
        return _parameter(path, low, high), np.linspace(low.value, high.value, count)
    if not isinstance(written, list) or not written:
        raise document.error(key, 'must be a list of values, or { from = "1 kg", to = "9 kg", count = 9 }.')
    try:
        listed = [parse_quantity(one, units, name=path) for one in written]
    except InputError as error:
        raise document.error(key, str(error)) from error
    return _parameter(path, *listed), np.asarray([one.value for one in listed])


def _parameter(path: str, *listed: Quantity) -> Parameter:
    unit = next((one.unit for one in listed if one.value != 0), listed[0].unit)
    return Parameter(path, "" if unit == "1" else unit)


def _range(values: np.ndarray, unit: str) -> dict[str, Any]:
    good = values[np.isfinite(values)]
    least, most = (float(good.min()), float(good.max())) if good.size else (float("nan"), float("nan"))
    return {"min": least, "max": most, "unit": unit}


def _draw(found: Sweep, out: Path, title: str) -> list[str]:
    if len(found.parameters) > 2 or (len(found.parameters) > 1 and not found.grid):
        return []
    from fitting.plots import save_figure

    names = []
    for name in found.results:
        ax = found.plot(name)
        ax.set_title(title)
        names.append(f"sweep_{''.join(c if c.isalnum() else '_' for c in name).strip('_')}.png")
        save_figure(ax.figure, out / names[-1])
    return names
