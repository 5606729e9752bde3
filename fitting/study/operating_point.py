"""The operating point that a table of a study gives."""

from fitting.study.model_modes import OperatingPoint
from twin.drives import RackPinionDrive
from twin.io.toml_table import TomlTable

KEYS = ("velocity", "preload")
"""Its keys."""


def operating_point(table: TomlTable, model: object) -> OperatingPoint:
    """Read `velocity` and `preload`.

    Args:
        table: the table.
        model: the model.

    Raises:
        InputError: no speed or no torque; a preload for a drive that has none.
    """
    speed = table.quantity("velocity", units=("m/s", "rad/s")).value if "velocity" in table else None
    if "preload" not in table:
        return OperatingPoint(speed)
    if not isinstance(getattr(model, "plant", model), RackPinionDrive):
        raise table.error("preload", f"{type(model).__name__} has no preload. Remove the key.")
    return OperatingPoint(speed, table.quantity("preload", units=("N m",)).value)
