"""How time is stepped: by constant steps, or adaptively under error control."""

from collections.abc import Callable
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, PyTree

from twin._checks import InputError, as_scalar, positive


class AbstractStepping(eqx.Module):
    """A way of stepping a plant through time."""


class ConstantSteps(AbstractStepping):
    """Explicit Runge-Kutta steps of constant length: `substeps` of them between two saved times or controller ticks.

    The result does not depend on the batch that it is computed in, and its derivative is the exact derivative of what
    was computed. The embedded method's estimate of the local error, from one saved time (or tick) to the next, is
    checked against the tolerance; what becomes of local errors over a whole run is for `choose_substeps` to tell.
    """

    substeps: int = eqx.field(static=True, default=4)
    """Steps between two saved times (or two ticks of a sampled controller)."""
    rtol: float = eqx.field(static=True, default=1e-3)
    """Tolerance on the local error of each state, relative to the state's largest magnitude in the run."""
    atol: float = eqx.field(static=True, default=1e-9)
    """Absolute tolerance on the same, in the state's unit."""
    solver: diffrax.AbstractERK = eqx.field(static=True, default_factory=diffrax.Bosh3)
    """Explicit Runge-Kutta method; its tableau is diffrax's."""

    def __check_init__(self):
        if self.substeps < 1:
            raise InputError(f"substeps must be at least 1, but is {self.substeps}.")


class AdaptiveSteps(AbstractStepping):
    """Steps chosen by error control, integrated by diffrax.

    With `gradient="forward"` the sensitivities are integrated together with the state and count in the error norm, so
    that a derivative is as accurate as the tolerance says (differentiating through an error-controlled solve is not).
    """

    rtol: Float[Array, ""] = eqx.field(converter=as_scalar, default=1e-6)
    """Relative tolerance of states and sensitivities."""
    atol: Float[Array, ""] = eqx.field(converter=as_scalar, default=1e-9)
    """Absolute tolerance, in the unit of each state."""
    solver: diffrax.AbstractSolver = eqx.field(default_factory=diffrax.Dopri8)
    """Any diffrax solver."""
    max_steps: int = eqx.field(static=True, default=100_000)
    """Steps after which the run is given up and marked."""
    min_step: float = eqx.field(static=True, default=1e-12)
    """Step length [s] below which the run is given up: one diverging lane must not stall its batch."""
    gradient: str = eqx.field(static=True, default="forward")
    """"forward": forward sensitivities, as accurate as the tolerance. "reverse": `jax.grad` through the steps taken,
    for many parameters; its accuracy is not controlled and lags the values' by some digits."""

    def __check_init__(self):
        positive("rtol", self.rtol)
        positive("atol", self.atol)
        if self.gradient not in ("forward", "reverse"):
            raise InputError(f'gradient must be "forward" or "reverse", but is {self.gradient!r}.')


def stage_times(stepping: ConstantSteps, start: Array, length: Array) -> Float[Array, "substeps stages"]:
    """The times at which `runge_kutta_steps` asks for the vector field [s].

    Args:
        stepping: number of steps, and the diffrax method whose tableau is used.
        start: time at the start [s].
        length: length of all steps together [s].
    """
    tableau: Any = stepping.solver.tableau
    nodes = np.concatenate([[0.0], np.asarray(tableau.c)])
    return start + length / stepping.substeps * (np.arange(stepping.substeps)[:, None] + nodes)


def runge_kutta_steps(
    stepping: ConstantSteps,
    vector_field: Callable,
    start: Array,
    length: Array,
    state: PyTree[Array],
    inputs: PyTree[Array] = None,
) -> tuple[PyTree[Array], PyTree[Array]]:
    """Explicit Runge-Kutta steps of equal length, with the stages written out.

    diffrax's own `step` runs its stages in a loop, which costs more than the whole arithmetic of a feed drive; written
    out, XLA fuses them. The steps themselves are looped over: writing them out too compiles longer and runs no faster.

    Args:
        stepping: number of steps, and the diffrax method whose tableau is used.
        vector_field: function of (t, state, inputs).
        start: time at the start [s].
        length: length of all steps together [s].
        state: state at the start.
        inputs: what the vector field gets at the `stage_times`, arrays with leading axes (substeps, stages); if it is
            the same throughout, leave it out.

    Returns:
        The state at the end, and the sum of the magnitudes of the embedded estimates of the local errors, in the same
        structure, not differentiated.
    """
    tableau: Any = stepping.solver.tableau
    step = length / stepping.substeps
    nodes = np.concatenate([[0.0], np.asarray(tableau.c)])

    def one(carry: Any, item: Any) -> tuple[Any, None]:
        state, last, total = carry
        i, given = item

        def rate(stage: int, y: PyTree[Array]) -> PyTree[Array]:
            at = jax.tree.map(lambda rows: rows[stage], given)
            return vector_field(start + (i + nodes[stage]) * step, y, at)

        stages = [last if tableau.fsal else rate(0, state)]
        for stage, row in enumerate(tableau.a_lower, start=1):
            stages.append(rate(stage, _advance(state, step, row, stages)))
        state = _advance(state, step, tableau.b_sol, stages)
        error = jax.lax.stop_gradient(_combine(step, tableau.b_error, stages))
        total = jax.tree.map(lambda sum_, e: sum_ + jnp.abs(e), total, error)
        return (state, stages[-1], total), None

    first = vector_field(start, state, jax.tree.map(lambda rows: rows[0, 0], inputs))
    carry = (state, first, jax.tree.map(jnp.zeros_like, state))
    if stepping.substeps == 1:
        carry, _ = one(carry, (0, jax.tree.map(lambda rows: rows[0], inputs)))
    else:
        carry, _ = jax.lax.scan(one, carry, (jnp.arange(stepping.substeps), inputs))
    return carry[0], carry[2]


def _combine(step: Array, weights: ArrayLike, stages: list) -> PyTree[Array]:
    used = [(float(w), k) for w, k in zip(np.asarray(weights), stages, strict=True) if w != 0.0]
    factors = [w for w, _ in used]
    return jax.tree.map(lambda *k: step * sum(w * x for w, x in zip(factors, k, strict=True)), *[k for _, k in used])


def _advance(state: PyTree[Array], step: Array, weights: ArrayLike, stages: list) -> PyTree[Array]:
    return jax.tree.map(jnp.add, state, _combine(step, weights, stages))
