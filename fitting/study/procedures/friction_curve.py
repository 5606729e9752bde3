"""Friction over speed from records of constant speed, or of several constant speeds.

[identify]
procedure = "friction_curve"
torque_constant = "0.8 N m/A"       # that of the model, if it is not given
travel_per_turn = "10 mm"           # where speed or position are those of a slide
"""

import dataclasses
from pathlib import Path

import numpy as np

from fitting.identification.friction_curve import constant_speed_fault, friction_curve
from fitting.identification.inverse_dynamics import DerivativeFilter
from fitting.identification.speed_plateaus import speed_plateaus
from fitting.plots_friction import plot_friction_curve
from fitting.study.data import data_names, read_record
from fitting.study.procedures._found import Found
from fitting.study.study_file import StudyFile
from twin._checks import InputError
from twin.drives import CurrentDrivenAxis
from twin.io.toml_table import TomlTable
from twin.record import Record

HELP = "friction over speed from records of one or of several constant speeds, with error bars"
KEYS = ("torque_constant", "travel_per_turn", "velocity", "current", "setpoint", "tolerance", "shortest")


def run(study: StudyFile, table: TomlTable, out: Path) -> Found:
    """Reduce every constant speed of the study to a point of the curve; write `friction.csv` and `friction.png`.

    Args:
        study: the study; its records with the channels `velocity` or `position`, and `current`.
        table: [identify].
        out: folder for the results.

    Raises:
        InputError: no record, a missing channel, no constant speed, and as `friction_curve`.
    """
    names = data_names(study, "record")
    if not names:
        raise study.document.error(("data",), "there are no records. Add a table [data.NAME] with a file and channels.")
    axis = study.model if isinstance(study.model, CurrentDrivenAxis) else None
    known = {} if axis is None else {"torque_constant": f"{float(axis.torque_constant)!r} N m/A"}
    constant = table.quantity("torque_constant", known.get("torque_constant"), units=("N m/A", "N/A")).value
    tolerance = table.quantity("tolerance", 0.02, units=("1",)).value
    velocity, current = table.text("velocity", "velocity"), table.text("current", "current")
    travel = None if axis is None else float(axis.travel_per_turn)
    if "travel_per_turn" in table:
        travel = table.quantity("travel_per_turn", units=("m",)).value
    parts, remarks = [], []
    for name in names:
        record = _turning(table, read_record(study, name).record, velocity, travel)
        if not constant_speed_fault(np.asarray(record.channel(velocity)), tolerance):
            parts.append(record)
            continue
        found = speed_plateaus(
            record,
            velocity=velocity,
            setpoint=table.text("setpoint") if "setpoint" in table else None,
            shortest=table.quantity("shortest", "0.1 s", units=("s",), positive=True).value,
            tolerance=tolerance,
        )
        remarks.append(f"{name}: {len(found)} stretches of constant speed.")
        parts += [dataclasses.replace(one, name=f"{name} from {float(one.times[0]):.4g} s") for one in found]
    if not parts:
        raise table.error(
            "procedure",
            f"no record holds a constant speed ({' '.join(remarks)}) Measure longer at each speed, lower `shortest`, "
            "or raise `tolerance`.",
        )
    curve = friction_curve(parts, constant, velocity=velocity, current=current, tolerance=tolerance, skip=True)
    from fitting.plots import save_figure

    frame = curve.to_dataframe()
    frame.to_csv(out / "friction.csv", index=False)
    save_figure(plot_friction_curve(curve).figure, out / "friction.png")
    told = [*remarks, *curve.rejected]
    return Found(
        "\n".join([frame.to_string(index=False), *told]), {"points": frame.to_dict(orient="records"), "remarks": told}
    )


def _turning(table: TomlTable, record: Record, velocity: str, travel: float | None) -> Record:
    """The record with the speed of the motor [rad/s], from its position where there is no speed."""
    if velocity not in record.channels:
        if "position" not in record.channels:
            raise InputError(f"{record.name} has neither a channel {velocity!r} nor `position`. Name one of them so.")
        derivatives = DerivativeFilter(cutoff=min(100.0, 0.2 * float(record.sample_rate)))
        speed = derivatives(np.asarray(record.channel("position")), float(record.sample_period))[1]
        record = record.with_channel(velocity, speed, f"{record.units['position']}/s")
    if record.units[velocity] != "m/s":
        return record
    if travel is None:
        raise table.error(
            "travel_per_turn", 'is missing: the speed is that of a slide. Give the travel per turn, such as "10 mm".'
        )
    return record.with_channel(velocity, np.asarray(record.channel(velocity)) * 2 * np.pi / travel, "rad/s")
