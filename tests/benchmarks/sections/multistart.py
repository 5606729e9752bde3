"""Many starts of a drive fit against SciPy's loops."""

from tests.benchmarks import multistart
from tests.benchmarks.sections import Options, Section


def section(options: Options) -> Section:
    """Both cases."""
    cases = multistart.all_cases()
    return Section(multistart.as_markdown(cases), multistart.as_dictionary(cases), multistart.summary_rows(cases))
