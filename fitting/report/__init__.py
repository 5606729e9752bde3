"""Reports of a run: one self-contained HTML page, made from the result objects of this package.

`fit_report` makes the report of a fit. For other runs the sections are put together by hand:
`write_report("page.html", Report("Sweep", asked_section(Asked("...")), sections=(sweep_section(found),)))`.
"""

from fitting.report.asked import Asked, asked_section
from fitting.report.compared import Compared, compared
from fitting.report.comparison import comparison_section
from fitting.report.content import Bar, Cell, Figure, Folded, Report, Section, Table
from fitting.report.control_results import controls_section
from fitting.report.correlation import correlation_section
from fitting.report.data import records_section
from fitting.report.fit_report import fit_report
from fitting.report.many_starts import many_starts_section
from fitting.report.modes import modes_section
from fitting.report.page import page_of, write_report
from fitting.report.parameters import parameters_section
from fitting.report.profiles import profiles_section
from fitting.report.ranking import ranking_section
from fitting.report.residuals import residuals_section
from fitting.report.responses import responses_section
from fitting.report.sweeps import sweep_section
from fitting.report.warnings import warnings_of

__all__ = [
    "Asked",
    "Bar",
    "Cell",
    "Compared",
    "Figure",
    "Folded",
    "Report",
    "Section",
    "Table",
    "asked_section",
    "compared",
    "comparison_section",
    "controls_section",
    "correlation_section",
    "fit_report",
    "many_starts_section",
    "modes_section",
    "page_of",
    "parameters_section",
    "profiles_section",
    "ranking_section",
    "records_section",
    "residuals_section",
    "responses_section",
    "sweep_section",
    "warnings_of",
    "write_report",
]
