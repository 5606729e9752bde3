"""Section: controls of the fit."""

from collections.abc import Sequence

from fitting.controls import Control
from fitting.report.content import Cell, Section, Table, number_cells
from fitting.report.numbers import plain


def controls_section(controls: Sequence[Control]) -> Section:
    """What the controls say about the fit.

    Args:
        controls: of `fitting.controls`.
    """
    rows = tuple(
        (
            Cell(control.name),
            *number_cells(plain(x, 3) for x in (control.fitted_rms, control.rms, control.ratio)),
            Cell("passed", "good") if control.passed else Cell("failed", "bad"),
        )
        for control in controls
    )
    head = ("Control", "Residual of the fit [-]", "Residual of the control [-]", "Ratio [-]", "Result")
    return Section(
        "Controls",
        text="Data that were held back should be predicted about as well as those that were fitted. Shuffled data "
        "should not be explained.",
        tables=(Table(head, rows, "Weighted residuals, rms"),),
        remarks=tuple(control.sentence for control in controls),
    )
