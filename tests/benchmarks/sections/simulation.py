"""The EMPS axis: one simulation and its Jacobian against SciPy and CasADi."""

from tests.benchmarks.emps_case import dahl_case, rigid_case
from tests.benchmarks.emps_report import as_dictionary, as_markdown, summary_rows
from tests.benchmarks.emps_simulation import compare, compare_best
from tests.benchmarks.sections import Options, Section


def section(options: Options) -> Section:
    """Run the stretches, and the whole record unless it is to be short."""
    rigid = rigid_case()
    stretch = compare(rigid.first(options.ticks), rounds=options.rounds)
    comparisons = [stretch, compare(dahl_case().first(options.ticks), rounds=options.rounds)]
    if not options.short:
        comparisons.insert(0, compare_best(rigid, stretch, rounds=options.rounds))
    return Section(
        as_markdown(comparisons),
        [as_dictionary(comparison) for comparison in comparisons],
        [row for comparison in comparisons for row in summary_rows(comparison)],
    )
