"""What a particle swarm pays for the error that gradients reach."""

from tests.benchmarks import swarm, swarm_price
from tests.benchmarks.sections import Options, Section


def section(options: Options) -> Section:
    """The ledger, and the curve fits of Leipe et al. as their reproduction counts them."""
    ledger, prices = swarm.swarm_ledger(), swarm_price.curve_fits()
    return Section(
        swarm.as_markdown(ledger) + "\n" + swarm_price.as_markdown(prices),
        {"ledger": swarm.as_dictionary(ledger), "curve_fits": swarm_price.as_dictionary(prices)},
        swarm.summary_rows(ledger) + swarm_price.summary_rows(prices),
    )
