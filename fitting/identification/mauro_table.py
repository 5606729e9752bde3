"""Table 1 of Mauro et al.: performance of a ball-screw axis over the gain of its position loop.

S. Mauro, S. Pastorelli, T. Mohtar, "Sensitivity Analysis of the Transmission Chain of a Horizontal Machining Tool Axis
to Design and Control Parameters", Advances in Mechanical Engineering 6 (2014). The numbers are as printed, in the units
printed. Time and energy of the row k_v = 2500 repeat those of the row 2725 to every digit: a misprint, as both change
steadily from row to row, and the cost printed beside them fits values between those of the neighbouring rows better.
"""

from typing import NamedTuple

import numpy as np


class MauroTable(NamedTuple):
    """Columns of Table 1, one entry per gain."""

    gain: np.ndarray
    """Gain of the position loop k_v [1/min]."""
    error: np.ndarray
    """Static position error, its magnitude [µm]."""
    time: np.ndarray
    """Response time τ [s]."""
    energy: np.ndarray
    """Energy per cycle [kJ]."""
    cost: np.ndarray
    """Cost C as printed, eq. 22 [-]."""


OPTIMAL_GAIN = 2725.0
"""Gain that the paper finds best [1/min]."""

REPEATED_GAIN = 2500.0
"""Gain of the row whose time and energy are those of the next row [1/min]."""

_ROWS = """
625 758 1.548 2.948 -0.852
925 479 1.434 3.508 -1.127
1225 337 1.386 3.850 -1.272
1525 246 1.363 4.068 -1.366
1825 173 1.351 4.211 -1.448
2125 102 1.343 4.309 -1.531
2425 41 1.338 4.378 -1.604
2500 28 1.334 4.427 -1.620
2725 5 1.334 4.427 -1.648
3025 36 1.331 4.462 -1.603
3325 55 1.329 4.488 -1.577
3625 64 1.327 4.507 -1.563
3925 65 1.325 4.521 -1.561
4225 59 1.324 4.531 -1.569
4525 51 1.323 4.540 -1.579
4825 44 1.322 4.545 -1.588
5125 38 1.321 4.550 -1.595
5425 33 1.320 4.553 -1.602
5725 29 1.319 4.556 -1.608
6025 25 1.319 4.558 -1.613
"""


def mauro_table() -> MauroTable:
    """Table 1 as printed."""
    return MauroTable(*np.array([row.split() for row in _ROWS.strip().splitlines()], dtype=float).T)
