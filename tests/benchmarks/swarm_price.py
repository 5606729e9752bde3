"""Evaluations of a swarm and of a gradient fit for the two curves of Leipe et al., eq. 4 and 9, on scattered points."""

from typing import Any, NamedTuple

from fitting.identification.leipe import fit_printed_curves
from fitting.identification.swarm_price import swarm_price
from tests.benchmarks.summary import SummaryRow, ratio_row

SCATTER = 0.01
"""Relative scatter of the points: with the paper's 4 % the swarm does not get to the damping's error at all."""
GOAL = 100.0
"""Least ratio of evaluations."""


class Price(NamedTuple):
    """What one curve costs."""

    curve: str
    swarm: int
    """Evaluations of the swarm; in all, if it does not get there."""
    gradients: int
    """Evaluations of the gradient fit, its start and the columns of its Jacobians counted."""
    reached: bool
    """Whether the swarm reached the gradient fit's error, to a part in a million."""


def curve_fits(scatter: float = SCATTER) -> list[Price]:
    """Both curves, each fitted by gradients first.

    Args:
        scatter: relative deviation of the points.
    """
    curves, prices = fit_printed_curves(scatter), []
    for i, curve in enumerate(("stiffness", "damping")):
        swarm, paid = swarm_price(curves.scattered[i], curves.forces, curves.totals[i])
        prices.append(Price(curve, swarm.evaluations, paid, swarm.reached))
    return prices


def summary_rows(prices: list[Price]) -> list[SummaryRow]:
    """The ratios of evaluations for the summary."""
    rows = []
    for price in prices:
        told = "same error to 1e-6" if price.reached else "swarm did not get there: a lower bound"
        what = f"Leipe, fit of the {price.curve} curve, evaluations"
        rows.append(ratio_row(what, "particle swarm", [price.swarm], [price.gradients], told, least=GOAL))
    return rows


def as_markdown(prices: list[Price]) -> str:
    """One line for each curve."""
    lines = [
        f"Curve fits of Leipe et al. on points with {100 * SCATTER:g} % scatter, evaluations to the same error:",
        "",
    ]
    lines += [
        f"- {p.curve}: swarm {p.swarm}{'' if p.reached else ' without getting there'}, gradients {p.gradients}"
        for p in prices
    ]
    return "\n".join([*lines, ""])


def as_dictionary(prices: list[Price]) -> list[dict[str, Any]]:
    """The same for `benchmarks.json`."""
    return [price._asdict() for price in prices]
