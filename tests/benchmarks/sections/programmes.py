"""SLSQP against SciPy's and slsqp-jax."""

from tests.benchmarks import programmes
from tests.benchmarks.peer_slsqp_jax import slsqp_jax_row
from tests.benchmarks.sections import Options, Section


def section(options: Options) -> Section:
    """The collection of Hock and Schittkowski, and one problem from many starts."""
    found = programmes.counts()
    speeds = programmes.throughputs(options.starts, options.rounds)
    return Section(
        programmes.as_markdown(found, speeds),
        programmes.as_dictionary(found, speeds),
        [*programmes.summary_rows(found, speeds), slsqp_jax_row(programmes.chain())],
    )
