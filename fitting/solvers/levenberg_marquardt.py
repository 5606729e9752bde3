"""Levenberg-Marquardt with true bounds, as an optimistix solver."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float, Int, PyTree

from fitting.solvers.dense import bounded_least_squares
from fitting.solvers.stop import Stop


class BoundedState(eqx.Module):
    """State of the bounded Levenberg-Marquardt solver at its best point so far."""

    residual: Float[Array, "residuals"]
    """Residual r."""
    jacobian: Float[Array, "residuals variables"]
    """Jacobian of r."""
    damping: Float[Array, ""]
    """Marquardt's λ, relative to the squared column norms."""
    growth: Float[Array, ""]
    """Factor by which a rejected step raises λ."""
    scale: Float[Array, "variables"]
    """Largest column norms of the Jacobian so far."""
    offset: Float[Array, ""]
    """√(reduction that the linear model still promises / cost): Bates and Watts' relative offset, bounds respected."""
    active: Bool[Array, "variables"]
    """Which variables sit on a bound that holds them back."""
    steps: Int[Array, ""]
    """Steps taken, rejected ones included; -1 before the start is evaluated."""
    history: Float[Array, "history"]
    """Cost after each step; NaN for steps not taken."""
    reason: Stop
    """Why it stopped, or `running`."""
    aux: PyTree[Array]
    """The objective's auxiliary output at the best point."""


class BoundedLevenbergMarquardt(optx.AbstractLeastSquaresSolver):
    """Levenberg-Marquardt for dense problems of up to some tens of unknowns, with bounds that are never left.

    Each step solves the damped linear least-squares problem within the bounds themselves, by QR and an active set
    (not a change of variables, not a clipped step). Damping follows Nielsen's rule on Marquardt's scaling. It stops by
    its own tests: the linear model promises nothing more (`rtol` on the relative offset, or `xtol` on the undamped
    step), or no step helps.

    Bounds are passed as `options={"lower": ..., "upper": ...}`, in the structure of y. The residual and its Jacobian
    are evaluated together, by forward mode.
    """

    rtol: float = 1e-8
    """Relative offset at which the fit has converged: √(promised reduction / cost)."""
    atol: float = 0.0
    """Norm of the residual at which any fit is good enough."""
    norm: Callable[[PyTree], Array] = optx.rms_norm
    """Unused; part of optimistix's interface."""
    xtol: float = 1e-12
    """Undamped step, relative to the variables, at which the fit has converged."""
    initial_damping: float = 1e-3
    """First λ."""
    history_length: int = 256
    """Steps whose cost is kept."""

    def init(
        self, fn: Any, y: PyTree, args: PyTree, options: dict, f_struct: PyTree, aux_struct: PyTree, tags: Any
    ) -> BoundedState:
        del fn, args, options, tags
        flat, _ = ravel_pytree(y)
        rows = sum(leaf.size for leaf in jax.tree.leaves(f_struct))
        # The start is evaluated by the first call of `step`: a simulation is then compiled once, not twice.
        return BoundedState(
            residual=jnp.zeros(rows),
            jacobian=jnp.zeros((rows, flat.size)),
            damping=jnp.asarray(self.initial_damping),
            growth=jnp.asarray(2.0),
            scale=jnp.zeros_like(flat),
            offset=jnp.asarray(jnp.inf),
            active=jnp.zeros(flat.size, dtype=bool),
            steps=jnp.asarray(-1),
            history=jnp.full(self.history_length, jnp.nan),
            reason=Stop.running,
            aux=jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), aux_struct),
        )

    def step(
        self, fn: Any, y: PyTree, args: PyTree, options: dict, state: BoundedState, tags: Any
    ) -> tuple[PyTree, BoundedState, PyTree]:
        del tags
        flat, unravel = ravel_pytree(y)
        lower, upper = _bounds(options, flat)
        first = state.steps < 0
        cost = 0.5 * jnp.sum(state.residual**2)

        triangle, projected = _triangle(state.jacobian, state.residual)
        damping = jnp.sqrt(state.damping) * jnp.where(first, 1.0, state.scale)
        step, _ = bounded_least_squares(triangle, -projected, damping, lower - flat, upper - flat)
        # Rounding in y + step must not leave the box.
        trial = jnp.where(first, flat, jnp.clip(flat + step, lower, upper))
        predicted = 0.5 * _promised(triangle, projected, step)

        residual, jacobian, aux = _linearise(fn, trial, unravel, args)
        good = jnp.all(jnp.isfinite(residual)) & jnp.all(jnp.isfinite(jacobian))
        gain = (cost - 0.5 * jnp.sum(residual**2)) / jnp.where(predicted > 0, predicted, 1.0)
        accept = good & (first | ((predicted > 0) & (gain > 1e-4)))

        # Nielsen 1999: a smooth decrease after good steps, an accelerating increase after rejected ones.
        eased = state.damping * jnp.maximum(1 / 3, 1 - (2 * gain - 1) ** 3)
        new_damping = jnp.where(accept, jnp.maximum(eased, 1e-15), state.damping * state.growth)
        new_damping = jnp.where(first, state.damping, new_damping)
        residual = jnp.where(accept, residual, state.residual)
        jacobian = jnp.where(accept, jacobian, state.jacobian)
        flat = jnp.where(accept, trial, flat)
        aux = jax.tree.map(lambda new, old: jnp.where(accept, new, old), aux, state.aux)
        scale = _column_norms(jacobian, state.scale)
        offset, active, small = _stationarity(residual, jacobian, scale, flat, lower, upper, self.xtol)
        new_cost = 0.5 * jnp.sum(residual**2)

        done = (offset <= self.rtol) | small | (2 * new_cost <= self.atol**2)
        tiny = jnp.all(jnp.abs(step) <= 4 * jnp.finfo(flat.dtype).eps * jnp.abs(flat)) | (new_damping > 1e30)
        # A promised reduction of less than 1e-12 of the cost drowns in the rounding of a simulated residual.
        drowned = ~accept & (offset < 1e-6)
        stuck = (~accept & tiny) | drowned
        reason = Stop.where(stuck, Stop.where(offset < 1e-5, Stop.at_precision, Stop.stalled), Stop.running)
        reason = Stop.where(done, Stop.converged, reason)
        hopeless = first & ~good
        steps = state.steps + 1
        new_state = BoundedState(
            residual=residual,
            jacobian=jacobian,
            damping=new_damping,
            growth=jnp.where(accept, 2.0, 2 * state.growth),
            scale=scale,
            offset=jnp.where(hopeless, jnp.inf, offset),
            active=active,
            steps=steps,
            history=state.history.at[jnp.minimum(steps, self.history_length - 1)].set(
                jnp.where(hopeless, jnp.nan, new_cost)
            ),
            reason=Stop.where(hopeless, Stop.not_finite, reason),
            aux=aux,
        )
        return unravel(flat), new_state, aux

    def terminate(
        self, fn: Any, y: PyTree, args: PyTree, options: dict, state: BoundedState, tags: Any
    ) -> tuple[Bool[Array, ""], optx.RESULTS]:
        del fn, y, args, options, tags
        stopped = state.reason != Stop.running
        result = optx.RESULTS.where(
            state.reason == Stop.stalled, optx.RESULTS.nonlinear_divergence, optx.RESULTS.successful
        )
        return stopped, optx.RESULTS.where(state.reason == Stop.not_finite, optx.RESULTS.nonfinite, result)

    def postprocess(
        self, fn: Any, y: PyTree, aux: PyTree, args: PyTree, options: dict, state: BoundedState, tags: Any, result: Any
    ) -> tuple[PyTree, PyTree, dict]:
        del fn, aux, args, options, tags, result
        # A start that is not finite ends the iteration before the first step.
        gave_up = Stop.where(state.steps < 0, Stop.not_finite, Stop.too_many_steps)
        reason = Stop.where(state.reason == Stop.running, gave_up, state.reason)
        return y, state.aux, {"reason": reason}


def _bounds(options: dict, flat: Float[Array, "variables"]) -> tuple[Array, Array]:
    lower, upper = options.get("lower"), options.get("upper")
    low = jnp.full_like(flat, -jnp.inf) if lower is None else ravel_pytree(lower)[0]
    high = jnp.full_like(flat, jnp.inf) if upper is None else ravel_pytree(upper)[0]
    return low, high


def _linearise(fn: Any, flat: Array, unravel: Callable, args: PyTree) -> tuple[Array, Array, PyTree]:
    def residual(vector: Array) -> tuple[Array, tuple[Array, PyTree]]:
        out, aux = fn(unravel(vector), args)
        values = ravel_pytree(out)[0]
        return values, (values, aux)

    jacobian, (values, aux) = jax.jacfwd(residual, has_aux=True)(flat)
    return values, jacobian, aux


def _column_norms(jacobian: Array, before: Array) -> Array:
    norms = jnp.maximum(jnp.sqrt(jnp.sum(jacobian**2, axis=0)), before)
    # A column of zeros (a parameter that these data do not see) still needs some damping.
    return jnp.where(norms > 0, norms, 1.0)


def _triangle(jacobian: Array, residual: Array) -> tuple[Array, Array]:
    """R and Qᵀr of the QR factorisation of the Jacobian, from one factorisation of [J | r]."""
    columns = jacobian.shape[1]
    stacked = jnp.concatenate([jacobian, residual[:, None]], axis=1)
    missing = max(0, columns + 1 - stacked.shape[0])
    stacked = jnp.concatenate([stacked, jnp.zeros((missing, columns + 1))])
    factor = jnp.linalg.qr(stacked, mode="r")
    return factor[:columns, :columns], factor[:columns, columns]


def _stationarity(
    residual: Array, jacobian: Array, scale: Array, flat: Array, lower: Array, upper: Array, xtol: float
) -> tuple[Array, Array, Array]:
    """Relative offset within the bounds, the active bounds, and whether the undamped step is negligible."""
    triangle, projected = _triangle(jacobian, residual)
    # Just enough damping to make directions that the data do not see harmless.
    step, active = bounded_least_squares(triangle, -projected, 1e-10 * scale, lower - flat, upper - flat)
    promised = _promised(triangle, projected, step)
    total = jnp.sum(residual**2)
    offset = jnp.sqrt(jnp.maximum(promised, 0.0) / jnp.where(total > 0, total, 1.0))
    small = jnp.sqrt(jnp.sum((scale * step) ** 2)) <= xtol * jnp.sqrt(jnp.sum((scale * flat) ** 2))
    return offset, active, small


def _promised(triangle: Array, projected: Array, step: Array) -> Array:
    """‖r‖² - ‖r + J·step‖², written so that nothing cancels where the step is small but bounds hold the gradient up."""
    change = triangle @ step
    return -jnp.sum(change * (2 * projected + change))
