"""Imports, and the first result of a new process."""

from tests.benchmarks import first_use
from tests.benchmarks.sections import Options, Section


def section(options: Options) -> Section:
    """All imports and tasks."""
    found = first_use.first_use()
    return Section(first_use.as_markdown(found), first_use.as_dictionary(found), first_use.summary_rows(found))
