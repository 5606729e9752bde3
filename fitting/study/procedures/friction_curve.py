"""Friction over speed from records of constant speed.

[identify]
procedure = "friction_curve"
torque_constant = "0.8 N m/A"
"""

from pathlib import Path

from fitting.identification.friction_curve import friction_curve
from fitting.plots_friction import plot_friction_curve
from fitting.study.data import data_names, read_record
from fitting.study.procedures._found import Found
from fitting.study.study_file import StudyFile
from twin.io.toml_table import TomlTable

HELP = "friction over speed from records of constant speed, with error bars"
KEYS = ("torque_constant", "velocity", "current", "tolerance")


def run(study: StudyFile, table: TomlTable, out: Path) -> Found:
    """Reduce every record of the study to a point of the curve; write `friction.csv` and `friction.png`.

    Args:
        study: the study; its records with the channels `velocity` and `current`.
        table: [identify].
        out: folder for the results.

    Raises:
        InputError: no record, a missing channel, and as `friction_curve`.
    """
    records = [read_record(study, name).record for name in data_names(study, "record")]
    if not records:
        raise study.document.error(("data",), "there are no records. Add one table [data.NAME] for each speed.")
    constant = table.quantity("torque_constant", units=("N m/A", "N/A")).value
    curve = friction_curve(
        records,
        constant,
        velocity=table.text("velocity", "velocity"),
        current=table.text("current", "current"),
        tolerance=table.quantity("tolerance", 0.02, units=("1",)).value,
    )
    from fitting.plots import save_figure

    frame = curve.to_dataframe()
    frame.to_csv(out / "friction.csv", index=False)
    save_figure(plot_friction_curve(curve).figure, out / "friction.png")
    return Found(frame.to_string(index=False), {"points": frame.to_dict(orient="records")})
