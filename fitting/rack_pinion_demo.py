"""The demo: a preloaded rack and pinion, identified from records that it makes itself, the way a user would.

A simulated bench with more in it than the model has (cogging, friction that rises towards standstill, encoders, noise)
is swept at several preloads. The records are written as CSV files, a study file beside them, and `drivetwin identify`
does the rest.
"""

import time
from pathlib import Path
from typing import Any

import numpy as np

from fitting.identification.leipe_bench import bench_drive, measure, sweep_reference
from fitting.json_file import write_json
from fitting.study.identify_run import run_identify
from fitting.study.new_study import new_study
from fitting.study.study_file import read_study
from twin.export import write_trajectory
from twin.paths import get_leaf

PRELOADS = (8.0, 15.0, 30.0, 55.0, 100.0)
"""Preloads of the sweeps [%]."""
HELD_BACK = 30.0
"""The one that is predicted [%]."""
_DURATION = 20.0
_UNITS = {"position_1": "mm", "position_2": "mm", "table_position": "mm"}


def make_records(folder: Path, *, seed: int = 1, preloads: tuple[float, ...] = PRELOADS) -> dict[str, float]:
    """Sweep the bench and write one CSV file for each preload.

    Args:
        folder: where the files go; made if missing.
        seed: of the noise.
        preloads: in per cent of the rated torque.

    Returns:
        Preload in per cent by name of the file, its ending left out.
    """
    folder.mkdir(parents=True, exist_ok=True)
    found = {}
    for percent, one in zip(
        preloads, measure(preloads, sweep_reference(_DURATION), 1.0 + _DURATION, seed=seed), strict=True
    ):
        name = f"sweep_{percent:g}"
        write_trajectory(folder / f"{name}.csv", one.record, units=_UNITS)
        found[name] = percent
    return found


def write_study(file: Path, sweeps: dict[str, float]) -> Path:
    """Write the study that identifies the drive from the records.

    Args:
        file: study file to write; the records lie in the folder `records` beside it.
        sweeps: preload in per cent by name of the record.
    """
    text = new_study("rack-pinion")
    model = text[text.index("[model]") : text.index("# One record for each preload")]
    blocks = []
    for name in sweeps:
        channels = [f'{c} = {{ column = "{c}", unit = "{u}" }}' for c, u in _UNITS.items()]
        channels += [f'{c} = {{ column = "{c}", unit = "N m" }}' for c in ("torque_1", "torque_2")]
        blocks.append(
            "\n".join([f"[data.{name}]", f'file = "records/{name}.csv"', f"[data.{name}.channels]", *channels])
        )
    listed = ", ".join(f'{name} = "{percent:g} %"' for name, percent in sweeps.items())
    asked = (
        f'[identify]\nprocedure = "preloaded_drive"\npreloads = {{ {listed} }}\nsweep_start = "1 s"\n'
        f'velocity = "5 mm/s"\nhold_back = ["sweep_{HELD_BACK:g}"]\nstarts = 64\n'
    )
    head = '[study]\ntitle = "Preloaded rack and pinion, simulated bench"\nseed = 1\n\n'
    file.write_text(head + model + "\n\n".join([*blocks, asked]), encoding="utf-8")
    return file


def run_demo(out: Path) -> str:
    """Make records, identify the drive, compare with the truth, and return the table.

    Args:
        out: folder for records, study and results.
    """
    clock = time.perf_counter()
    sweeps = make_records(out / "records")
    study = read_study(write_study(out / "demo.toml", sweeps))
    outcome = run_identify(study, out)
    truth = bench_drive()
    summary: dict[str, Any] = dict(outcome.summary or {})
    lines = ["", f"{'parameter':32} {'true':>12} {'estimate':>12} {'error':>8}"]
    for path, one in summary["parameters"].items():
        true = float(get_leaf(truth, path))
        one["true"] = true
        lines.append(f"{path:32} {true:12.5g} {one['value']:12.5g} {100 * (one['value'] / true - 1):7.1f} %")
    lines += ["", *_curves(outcome, truth, summary)]
    seconds = time.perf_counter() - clock
    summary["seconds"] = seconds
    write_json(out / "summary.json", summary)
    return "\n".join([outcome.text, *lines, f"{seconds:.0f} s; report: {out / 'report.html'}"])


def _curves(outcome: Any, truth: Any, summary: dict[str, Any]) -> list[str]:
    """Errors of the laws themselves, which is what counts: their parameters trade places with each other."""
    from twin.laws import HyperbolicDamping, RootStiffness

    values = {path.rsplit(".", 1)[-1]: one["value"] for path, one in summary["parameters"].items()}
    forces = np.linspace(500.0, 4500.0, 50)
    mesh = truth.train_1.mesh
    found = {
        "stiffness": (RootStiffness(values["k1"], values["k2"]), mesh.stiffness),
        "damping": (HyperbolicDamping(values["d1"], values["d2"], values["d3"]), mesh.damping),
    }
    lines = []
    for name, (law, true) in found.items():
        error = float(np.max(np.abs(np.asarray(law(forces)) / np.asarray(true(forces)) - 1)))
        summary[f"largest_{name}_error"] = error
        lines.append(f"largest error of the {name} between 0.5 and 4.5 kN: {100 * error:.2f} %")
    return lines
