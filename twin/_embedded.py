"""Integration by an embedded Runge-Kutta pair whose steps end at every saved time.

Written out for the small systems of this package: the stages are no loop, the state stays in its parts, nothing is
interpolated. A step costs little more than its evaluations of the vector field, alone and side by side in a batch.
"""

import functools
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from twin._powers import natural_logarithm
from twin.stepping import EmbeddedSteps, combine_stages

# Step lengths by a proportional and an integral part, as E. Hairer, G. Wanner, "Solving Ordinary Differential Equations
# II", 2nd ed., section IV.2: where stability bounds the step, a purely integral one has a step in ten rejected.
_INTEGRAL, _PROPORTIONAL, _SAFETY = 0.7, 0.4, 0.9
_SHRINK, _GROW = 0.2, 5.0
# Errors beyond these bounds change the step length by its limits all the same.
_LEAST_ERROR, _MOST_ERROR = 1e-10, 1e10
# The first step, as a part of the first interval.
_FIRST = 0.1


def integrate_embedded(
    field: Callable, state: list[Array], times: Float[Array, "times"], knots: Float[Array, "knots"], stepping: Any
) -> tuple[list[Array], Bool[Array, ""], Bool[Array, ""], Int[Array, ""]]:
    """States at the times.

    Args:
        field: function of (t, state), both as lists of arrays.
        state: state at the first time.
        times: saved times, increasing [s].
        knots: times at which the vector field may jump [s].
        stepping: an `EmbeddedSteps`.

    Returns:
        States with a leading axis over the times, whether the end was reached, whether the steps became too small, and
        the number of steps tried.
    """
    within = jnp.clip(knots, times[0], times[-1])
    stops = jnp.sort(jnp.concatenate([times, within])) if knots.shape[0] else times
    start = (times[0], state, _FIRST * (times[1] - times[0]), jnp.ones(()), jnp.zeros((), int))

    def interval(carry: Any, span: tuple[Array, Array]) -> tuple[Any, list[Array]]:
        carry = _to(field, stepping, carry, *span)
        return carry, carry[1]

    (reached, _, length, _, steps), rows = jax.lax.scan(interval, start, (stops[:-1], stops[1:]))
    # The last of equal stops: a knot may be a saved time.
    saved = jnp.searchsorted(stops, times[1:], side="right") - 2
    states = [jnp.concatenate([first[None], row[saved]]) for first, row in zip(state, rows, strict=True)]
    return states, reached >= times[-1], length <= stepping.min_step, steps


def _to(field: Callable, stepping: EmbeddedSteps, carry: Any, begin: Array, end: Array) -> Any:
    """From one stop to the next."""
    solver: Any = stepping.solver
    tableau = solver.tableau
    nodes = np.asarray(tableau.c)
    power = 1.0 / solver.order(None)
    # The vector field may jump at either stop: this side of it counts.
    first, last = jnp.nextafter(begin, end), jnp.nextafter(end, begin)

    def rate(t: Array, y: list[Array]) -> list[Array]:
        return field(jnp.clip(t, first, last), y)

    def goes_on(carry: Any) -> Array:
        t, _, _, length, _, steps = carry
        return (t < end) & (length > stepping.min_step) & (steps < stepping.max_steps)

    def one(carry: Any) -> Any:
        t, y, slope, length, before, steps = carry
        left = end - t
        # What is left is divided evenly, so that no short step remains; a rounding error more does not count.
        parts = jnp.maximum(jnp.ceil(left / length - 1e-6), 1.0)
        h = left / parts
        stages = [slope]
        for node, row in zip(nodes, tableau.a_lower, strict=True):
            stages.append(rate(t + node * h, _advance(y, h, row, stages)))
        after = _advance(y, h, tableau.b_sol, stages)
        error = _size(stepping, combine_stages(h, tableau.b_error, stages), y, after)
        accepted = error <= 1.0
        error = jnp.where(jnp.isfinite(error), jnp.clip(error, _LEAST_ERROR, _MOST_ERROR), _MOST_ERROR)
        wanted = -_INTEGRAL * natural_logarithm(error) + _PROPORTIONAL * natural_logarithm(before)
        factor = _SAFETY * jnp.exp(power * jnp.where(accepted, wanted, -natural_logarithm(error)))
        factor = jnp.clip(factor, _SHRINK, jnp.where(accepted, _GROW, _SAFETY))
        # A step that was cut short says little about the next one.
        proposed = jnp.where(accepted & (h < 0.5 * length), length, h * factor)

        def choose(new: list[Array], old: list[Array]) -> list[Array]:
            return [jnp.where(accepted, a, b) for a, b in zip(new, old, strict=True)]

        t = jnp.where(accepted, jnp.where(parts > 1, t + h, end), t)
        before = jnp.where(accepted, error, before)
        return t, choose(after, y), choose(stages[-1], slope), proposed, before, steps + 1

    t, y, length, before, steps = carry
    t, y, _, length, before, steps = jax.lax.while_loop(goes_on, one, (t, y, rate(t, y), length, before, steps))
    return t, y, length, before, steps


def _advance(state: list[Array], h: Array, weights: Any, stages: list) -> list[Array]:
    return [a + b for a, b in zip(state, combine_stages(h, weights, stages), strict=True)]


def _size(stepping: EmbeddedSteps, error: list[Array], before: list[Array], after: list[Array]) -> Float[Array, ""]:
    """Largest local error relative to the tolerance."""
    found: dict[tuple[int, ...], list[Array]] = {}
    for e, a, b in zip(error, before, after, strict=True):
        relative = jnp.abs(e) / (stepping.atol + stepping.rtol * jnp.maximum(jnp.abs(a), jnp.abs(b)))
        found.setdefault(e.shape, []).append(relative)
    # Parts of one shape are compared element by element first: reductions are slow.
    largest = [jnp.max(functools.reduce(jnp.maximum, parts), initial=0.0) for parts in found.values()]
    return functools.reduce(jnp.maximum, largest)
