"""Test problems of W. Hock and K. Schittkowski, Test Examples for Nonlinear Programming Codes, Springer, 1981."""

from tests.problems import (
    hock_schittkowski_001_030,
    hock_schittkowski_031_044,
    hock_schittkowski_045_056,
    hock_schittkowski_057_070,
    hock_schittkowski_071_081,
    hock_schittkowski_083_093,
    hock_schittkowski_095_106,
    hock_schittkowski_107_112,
    hock_schittkowski_113_119,
)
from tests.problems.nonlinear_programme import NonlinearProgramme

PROBLEMS: tuple[NonlinearProgramme, ...] = tuple(
    sorted(
        (
            *hock_schittkowski_001_030.PROBLEMS,
            *hock_schittkowski_031_044.PROBLEMS,
            *hock_schittkowski_045_056.PROBLEMS,
            *hock_schittkowski_057_070.PROBLEMS,
            *hock_schittkowski_071_081.PROBLEMS,
            *hock_schittkowski_083_093.PROBLEMS,
            *hock_schittkowski_095_106.PROBLEMS,
            *hock_schittkowski_107_112.PROBLEMS,
            *hock_schittkowski_113_119.PROBLEMS,
        ),
        key=lambda problem: int(problem.name.removeprefix("HS")),
    )
)
"""Every problem that could be confirmed, by number."""
