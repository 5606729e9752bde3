"""Reports of a run: one self-contained HTML page, made from the result objects of this package."""

from fitting.report.content import Bar, Cell, Figure, Folded, Report, Section, Table
from fitting.report.page import page_of, write_report

__all__ = ["Bar", "Cell", "Figure", "Folded", "Report", "Section", "Table", "page_of", "write_report"]
