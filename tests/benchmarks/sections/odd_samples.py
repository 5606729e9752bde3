"""What samples that are not as the others cost a batch."""

from tests.benchmarks.odd_samples import odd_samples
from tests.benchmarks.sections import Options, Section
from tests.benchmarks.summary import as_dictionary


def section(options: Options) -> Section:
    """A sample that is NaN, one that is a thousand times stiffer, one that raises."""
    rows = odd_samples()
    lines = ["## Odd samples in a batch", "", "Time with one odd sample over the time without it, in turns:", ""]
    lines += [f"- {row.what}: " + (row.met if row.ratio is None else f"{row.ratio:.3g}") for row in rows]
    return Section("\n".join([*lines, ""]), as_dictionary(rows), rows)
