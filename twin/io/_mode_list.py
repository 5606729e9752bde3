"""The modes that a universal file lists (dataset 55): numbers, not shapes."""

import math
from pathlib import Path
from typing import NamedTuple

from twin.io._uff import read_sets

_NORMAL, _COMPLEX = 2, (3, 7)


class ListedMode(NamedTuple):
    """One mode as a file has it."""

    number: int
    """Its number in the file."""
    frequency: float
    """Natural frequency [Hz]."""
    damping_ratio: float
    """Viscous damping ratio [-]."""
    nodes: int
    """Nodes that its shape is given at."""
    header: tuple[str, ...]
    """Lines of text that are not empty."""


def listed_modes(file: Path) -> list[ListedMode]:
    """Modes of a universal file, in its order; empty where it holds none.

    Args:
        file: the file.

    Raises:
        InputError: a file that cannot be read.
    """
    found = []
    for one in read_sets(file)[0]:
        if one["type"] != 55 or int(one["analysis_type"]) not in (_NORMAL, *_COMPLEX):
            continue
        if int(one["analysis_type"]) == _NORMAL:
            frequency, ratio = float(one["freq"]), float(one["modal_damp_vis"])
        else:
            size = abs(complex(one["eig"]))
            frequency, ratio = size / (2 * math.pi), -complex(one["eig"]).real / size if size else 0.0
        texts = (str(one.get(f"id{k}", "")).strip() for k in range(1, 6))
        header = tuple(text for text in texts if text and text.upper() != "NONE")
        found.append(ListedMode(int(one["mode_n"]), frequency, ratio, len(one["node_nums"]), header))
    return found
