"""Preloaded rack and pinion from sweeps at several preloads.

    [identify]
    procedure = "preloaded_drive"
    preloads = { sweep_8 = "8 %", sweep_20 = "20 %", sweep_50 = "50 %", sweep_100 = "100 %" }
    sweep_start = "1 s"
    velocity = "5 mm/s"
    hold_back = ["sweep_20"]
    starts = 50

The records hold position_1, position_2 (motors behind their gearboxes), table_position, torque_1 and torque_2.
"""

from pathlib import Path

import numpy as np

from fitting.identification.preload_sweep import PreloadSweep
from fitting.identification.preloaded_drive import PreloadedDrive, identify_preloaded_drive
from fitting.plots import save_figure
from fitting.study.data import read_record
from fitting.study.procedures._found import Found
from fitting.study.shown import shown
from fitting.study.study_file import StudyFile
from twin.drives import RackPinionDrive
from twin.io.quantity import parse_quantity
from twin.io.toml_table import TomlTable

HELP = "load-dependent stiffness and damping of a preloaded rack and pinion from sweeps at several preloads"
KEYS = ("preloads", "sweep_start", "velocity", "hold_back", "starts", "band")


def run(study: StudyFile, table: TomlTable, out: Path) -> Found:
    """Identify the laws of both meshes; writes `laws.png`.

    Args:
        study: the study; its model a `RackPinionDrive` with the known mass, ratio and pinion.
        table: [identify].
        out: folder for the results.

    Raises:
        InputError: another model, a sweep without preload, and as `identify_preloaded_drive`.
    """
    drive = study.model
    if not isinstance(drive, RackPinionDrive):
        raise table.error(
            "procedure", f"preloaded_drive is for a RackPinionDrive, but the model is {type(drive).__name__}."
        )
    preloads = table.table("preloads")
    if not preloads:
        raise table.error("preloads", 'names no sweep. Write preloads = { sweep_8 = "8 %", ... }, by data set.')
    begin = table.quantity("sweep_start", "0 s", units=("s",)).value
    velocity = table.quantity("velocity", "5 mm/s", units=("m/s",)).value
    sweeps, remarks = {}, []
    for name, written in preloads.items():
        percent = 100 * parse_quantity(written, ("1",), name=f"preload of {name}").value
        one = read_record(study, name)
        sweeps[name] = PreloadSweep(percent, one.record, begin, velocity)
        remarks += one.remarks
    band = table.texts("band", ("30 Hz", "200 Hz"))
    low, high = (parse_quantity(edge, ("Hz",), name="band").value for edge in band)
    found = identify_preloaded_drive(
        sweeps,
        drive,
        held=table.texts("hold_back", ()),
        band=(low, high),
        starts=table.integer("starts", 1),
        seed=study.seed,
    )
    _draw(found, out / "laws.png")
    estimates = found.result.to_dataframe()[["unit", "estimate", "standard error", "95 % from", "95 % to", "remark"]]
    lines = [shown(found.chain.to_dataframe())]
    lines.append(shown(estimates))
    lines += [found.result.message] + ([found.many.message] if found.many else [])
    lines += [f"Control {control.name}: {control.sentence}" for control in found.controls]
    intervals = found.result.intervals()
    summary = {
        "parameters": {
            path: {**found.result[path]._asdict(), "interval_95": intervals[i].tolist()}
            for i, path in enumerate(found.result.space.paths)
        },
        "status": found.result.message,
        "controls": [{"name": c.name, "passed": c.passed, "sentence": c.sentence} for c in found.controls],
        "remarks": remarks,
    }
    return Found(
        "\n".join(lines),
        summary,
        found.result,
        found.responses,
        {name: one.record for name, one in sweeps.items()},
        found.verdicts,
        found.many,
        found.controls,
    )


def _draw(found: PreloadedDrive, file: Path) -> None:
    from matplotlib import pyplot

    used = [point for point in found.chain.points if point.used]
    largest = max(abs(force) for point in used for force in point.forces)
    forces = np.linspace(0, 1.05 * largest, 200)
    mesh = found.result.model.train_1.mesh
    figure, axes = pyplot.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
    for ax, law, own, unit in (
        (axes[0], mesh.stiffness, found.chain.stiffness.law, "stiffness [N/µm]"),
        (axes[1], mesh.damping, found.chain.damping.law, "damping [N s/mm]"),
    ):
        factor = 1e-6 if "µm" in unit else 1e-3
        ax.plot(forces / 1e3, factor * np.asarray(own(forces)), "--", color="0.5", label="published chain")
        ax.plot(forces / 1e3, factor * np.asarray(law(forces)), label="fit to all responses")
        ax.set_xlabel("force through the mesh [kN]")
        ax.set_ylabel(f"{unit}")
        ax.set_ylim(bottom=0)
        ax.legend(frameon=False, fontsize="small")
    figure.suptitle("One drive train: stiffness and damping over the load")
    save_figure(figure, file)
