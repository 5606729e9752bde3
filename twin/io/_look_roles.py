"""What a channel probably is, by its name and unit."""

import re

from twin._checks import InputError
from twin.io.units import si_unit

# In order: the first that fits. Names as drive engineers write them, English and German.
_NAMES = (
    ("acceleration", r"acc|beschl|^a($|[_\d.])|xdd"),
    ("speed", r"vel|speed|geschw|drehz|omega|rpm|^v($|[_\d.])|^n($|[_\d.])|[._]v($|[_\d])|xdot|_d(ot)?$"),
    ("current", r"curr|strom|^i($|[_qd\d.])|_i$|iq"),
    ("torque", r"torq|moment|^tau|^m($|[_\d.])|trq"),
    ("force", r"force|kraft|^f($|[_\d.])"),
    ("voltage", r"volt|spann|^u($|[_\d.])"),
    ("temperature", r"temp"),
    ("position", r"pos|weg|lage|winkel|angle|theta|phi|^[xyzqs]($|[_\d.])|[._][xyzq]($|[_\d])|displ"),
)
_UNITS = {
    "m": "position", "rad": "position", "m/s": "speed", "rad/s": "speed", "m/s^2": "acceleration",
    "rad/s^2": "acceleration", "A": "current", "V": "voltage", "N": "force", "N m": "torque", "K": "temperature",
}  # fmt: skip
_LOAD = re.compile(r"last|load|tisch|table|schlitten|slide|abtrieb", re.I)
_SETPOINT = re.compile(r"soll|set|ref|cmd|command|target|demand", re.I)


def role_of(name: str, unit: str) -> str | None:
    """The quantity that a channel probably is, such as "position" or "speed_setpoint".

    Args:
        name: its name in the file.
        unit: its unit in the file, or an empty text.

    Returns:
        The quantity; None if neither name nor unit tells.
    """
    role = _UNITS.get(_si(unit)) if unit else None
    own = name.lower().rsplit("/", 1)[-1]
    if role is None:
        role = next((role for role, pattern in _NAMES if re.search(pattern, own)), None)
    if role is None:
        return None
    return f"{role}_setpoint" if _SETPOINT.search(own) else role


def model_name(name: str, unit: str) -> str | None:
    """What a model probably calls a channel, such as "velocity" or "load_position".

    Args:
        name: its name in the file.
        unit: its unit in the file, or an empty text.

    Returns:
        The name; None if neither name nor unit tells.
    """
    role = role_of(name, unit)
    if role is None:
        return None
    called = role.replace("speed", "velocity")
    is_load = called in ("position", "velocity") and _LOAD.search(name.lower().rsplit("/", 1)[-1])
    return f"load_{called}" if is_load else called


def _si(unit: str) -> str:
    try:
        return si_unit(unit)
    except InputError:
        return ""
