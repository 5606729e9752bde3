"""The best position gain of a cycle, found by derivatives instead of a sweep."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.curve_search import search_curve
from fitting.design_result import DesignResult
from fitting.gain_objective import GainObjective
from twin._checks import InputError, require_x64
from twin.parameters import Parameter, ParameterSpace
from twin.paths import get_leaf
from twin.performance import PositioningCycle, PositioningPerformance

POSITION_GAIN = "loop.controller.position_gain"
"""Path of the position gain in a cycle."""


def design_gain(
    cycle: PositioningCycle,
    objective: GainObjective,
    gain: Parameter | tuple[float, float],
    *,
    nodes: int = 5,
    max_evaluations: int = 20,
    tolerance: float = 1e-6,
) -> DesignResult:
    """The gain with the smallest cost of eq. 22 within bounds, |err| sharp, in fewer runs than a sweep takes.

    Error, energy and time are smooth in the gain; only |err| has a kink where the error changes its sign, and the best
    gain often lies there. The three are therefore computed with their derivatives at a few gains, interpolated, and the
    cost of the interpolation says which gain to try next. Where the simulation fails or the target is not reached,
    nothing is interpolated.

    Args:
        cycle: the cycle; its own gain does not matter.
        objective: eq. 22 with references; its width is not used here.
        gain: bounds of the position gain [1/s], or another parameter of the cycle with finite bounds; a log scale
            spreads the first gains evenly over its logarithm.
        nodes: gains to begin with, spread over the bounds.
        max_evaluations: simulations with derivative at which to give up.
        tolerance: cost that a further simulation has to promise.

    Returns:
        The cycle with the best gain simulated. `evaluations` counts every simulation, each with its derivative.

    Raises:
        InputError: 64-bit mode off, bounds that are not finite or not positive for the gain, or that are no pair, an
            objective that is none, fewer than two nodes or more than max_evaluations, a path that is not in the cycle.

    Source: cost and gain of Mauro et al., section 7; the search is ours.
    """
    require_x64()
    if not isinstance(objective, GainObjective):
        raise InputError(
            f"objective must be a GainObjective, but is a {type(objective).__name__}. GainObjective.of_sweep makes one "
            "from a sweep; fitting.optimal_design.design takes any function of the cycle."
        )
    if not isinstance(gain, Parameter):
        if not _is_range(gain):
            raise InputError(
                f"gain must be bounds (lower, upper) above zero in 1/s, but is {gain!r}. Exchange or change them."
            )
        gain = Parameter(POSITION_GAIN, "1/s", float(gain[0]), float(gain[1]), scale="log")
    space = ParameterSpace([gain])
    low, high = float(space.lower[0]), float(space.upper[0])
    if not (np.isfinite(low) and np.isfinite(high)):
        raise InputError(
            f"{gain.path} has the bounds {gain.lower:g} to {gain.upper:g}. Give finite ones, above zero on a log scale."
        )
    if not 2 <= nodes <= max_evaluations:
        raise InputError(f"nodes must be from 2 to max_evaluations ({max_evaluations}), but is {nodes}.")
    start = get_leaf(cycle, gain.path)

    def measure(x: float) -> tuple[np.ndarray, np.ndarray]:
        value, slope = _measures(cycle, objective, space, jnp.asarray([x]))
        return np.asarray(value), np.asarray(slope)

    # In NumPy there is nothing to compile for every number of points.
    numbers = jax.tree.map(np.asarray, objective)

    def cost(values: np.ndarray) -> np.ndarray:
        return numbers.sharp_cost(PositioningPerformance(*values))

    found = search_curve(measure, cost, low, high, nodes=nodes, most=max_evaluations, tolerance=tolerance)
    best = jnp.asarray([found.best])
    values = np.asarray(space.unscaled(best))
    failed = int(np.count_nonzero(np.isnan(found.costs)))
    active = np.asarray([found.stop == "converged" and min(found.best - low, high - found.best) <= 1e-9 * (high - low)])
    return DesignResult(
        model=space.unpack(cycle, best),
        space=space,
        start=np.asarray([float(start)]),
        values=values,
        cost=found.cost,
        history=np.fmin.accumulate(found.costs),
        evaluations=found.tried.size,
        gradients=found.tried.size,
        active=active,
        constraint_names=(),
        constraint_values=np.zeros(0),
        stop=found.stop,
        note=f"{failed} of the gains tried failed or did not reach the target." if failed else "",
    )


def _is_range(bounds: object) -> bool:
    """Whether these are two finite numbers above zero, the lower first."""
    try:
        low, high = (float(bound) for bound in bounds)  # pyright: ignore[reportGeneralTypeIssues]
    except (TypeError, ValueError):
        return False
    return 0 < low < high < np.inf


@eqx.filter_jit
def _measures(
    cycle: PositioningCycle, objective: GainObjective, space: ParameterSpace, vector: Float[Array, "parameters"]
) -> tuple[Float[Array, "measures"], Float[Array, "measures"]]:
    """Measures of a cycle and their slopes along the one parameter."""

    def at(x: Array) -> Array:
        return jnp.stack(objective.measures(space.unpack(cycle, x)))

    return jax.jvp(at, (vector,), (jnp.ones_like(vector),))
