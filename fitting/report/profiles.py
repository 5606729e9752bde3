"""Section: profile likelihoods."""

from functools import partial

import numpy as np

from fitting.plots_profile import plot_profile
from fitting.profile import ProfileResult
from fitting.report.content import Cell, Figure, Section, Table, number_cells
from fitting.report.numbers import plain
from fitting.result import FitResult


def profiles_section(profiles: ProfileResult, result: FitResult) -> Section:
    """Intervals that need no linear theory, and the profiles that they come from.

    Args:
        profiles: of `fitting.profile.profile`.
        result: the fit.
    """
    level = f"{100 * profiles.level:g} %"
    rows = tuple(
        (
            Cell(p.path, "name"),
            Cell(p.unit or "–", "unit"),
            *number_cells(plain(float(x)) for x in (p.estimate, *p.interval)),
            Cell(
                " and ".join(side for side, is_open in zip(("below", "above"), p.open, strict=True) if is_open) or "–"
            ),
        )
        for p in profiles.profiles
    )
    figures = tuple(
        Figure(
            partial(_draw, profiles, p.path, result),
            f"Profile of {p.path}",
            f"{p.path}: profile, straight where linear theory holds.",
        )
        for p in profiles.profiles
    )
    head = ("Parameter", "Unit", "Estimate", f"{level} from", f"{level} to", "No limit")
    return Section(
        "Profile likelihood",
        figures=figures,
        tables=(Table(head, rows, "Intervals by profile likelihood"),),
        remarks=(profiles.message,) if profiles.message else (),
    )


def _draw(profiles: ProfileResult, path: str, result: FitResult, axes: np.ndarray) -> None:
    plot_profile(profiles, path, fit=result, ax=axes[0])
