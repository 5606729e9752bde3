"""The study of a whole machine against NumPy, SciPy and SALib, and how its time grows."""

from tests.benchmarks import machine_report
from tests.benchmarks.machine import machine_benchmark
from tests.benchmarks.sections import Options, Section


def section(options: Options) -> Section:
    """The whole study."""
    found = machine_benchmark()
    return Section(
        machine_report.as_markdown(found), machine_report.as_dictionary(found), machine_report.summary_rows(found)
    )
