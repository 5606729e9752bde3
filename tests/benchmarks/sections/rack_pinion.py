"""The preloaded rack-and-pinion drive against SciPy, CasADi and a loop in C."""

from tests.benchmarks import rack_pinion, rack_report
from tests.benchmarks.sections import Options, Section


def section(options: Options) -> Section:
    """One run, many variants, and the Jacobian."""
    rows = rack_pinion.all_rows(options.rounds)
    return Section(rack_report.as_markdown(rows), rack_report.as_dictionary(rows), rack_report.summary_rows(rows))
