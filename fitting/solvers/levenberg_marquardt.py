"""Levenberg-Marquardt with true bounds, as an optimistix solver."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float, Int, PyTree

from fitting.solvers.stop import Stop
from fitting.solvers.trust_region import LinearModel, linear_model

# Root mean square of a weighted residual [-], and its norm as a share of that at the start, at which data are exact.
_EXACT, _LEFT = 1e-6, 1e-7


class BoundedState(eqx.Module):
    """State of the bounded Levenberg-Marquardt solver at its best point so far."""

    residual: Float[Array, "residuals"]
    """Residual r."""
    jacobian: Float[Array, "residuals variables"]
    """Jacobian of r."""
    trial: Float[Array, "variables"]
    """Point that is evaluated next."""
    predicted: Float[Array, ""]
    """Reduction of the cost that the linear model promises for it."""
    slope: Float[Array, ""]
    """Derivative of the cost along the step to it."""
    damping: Float[Array, ""]
    """Marquardt's λ of that step; zero for a Gauss-Newton step."""
    radius: Float[Array, ""]
    """Length of step that the linear model is trusted for, in the unit of the residual: ‖scale·step‖."""
    columns: Float[Array, "variables"]
    """Column norms of the Jacobian, now or before."""
    size: Float[Array, "variables"]
    """Largest magnitude of each variable so far; zero if it started from zero, which says nothing about its size."""
    scale: Float[Array, "variables"]
    """Weights of the variables in a step's length."""
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

    Moré's trust-region form ("The Levenberg-Marquardt algorithm: implementation and theory", 1978): the step is the
    best of those that are no longer than a radius, and the radius follows how well the last step's reduction was
    foreseen. Each step solves the damped linear least-squares problem within the bounds themselves, by an active set
    (not a change of variables, not a clipped step). No unit of a variable matters, as a step's length is weighted by
    the Jacobian's column norms. As in Moré's, former norms count too, for they keep a variable from running away when
    its column vanishes; here the memory fades as the cost falls, so that a far start does not tie the variables down
    for good.

    It has converged when the linear model promises nothing more (`rtol` on the relative offset), when the undamped step
    is negligible (`xtol`, or what rounding makes of the residual), or when no step helps where the gradient is zero, or
    where of exact data no residual is left but rounding.

    Bounds are passed as `options={"lower": ..., "upper": ...}`, in the structure of y. The residual and its Jacobian
    are evaluated together, by forward mode, once a step.
    """

    rtol: float = 1e-8
    """Relative offset at which the fit has converged: √(promised reduction / cost)."""
    atol: float = 1e-20
    """Norm of the residual at which any fit is good enough."""
    norm: Callable[[PyTree], Array] = optx.rms_norm
    """Unused; part of optimistix's interface."""
    xtol: float = 1e-12
    """Undamped step, relative to each variable, at which the fit has converged."""
    initial_radius: float = 1.0
    """First radius, relative to the norm of the residual."""
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
            trial=flat,
            predicted=jnp.asarray(0.0),
            slope=jnp.asarray(0.0),
            damping=jnp.asarray(0.0),
            radius=jnp.asarray(0.0),
            columns=jnp.zeros_like(flat),
            size=jnp.zeros_like(flat),
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
        before, unravel = ravel_pytree(y)
        lower, upper = _bounds(options, before)
        first = state.steps < 0

        residual, jacobian, aux = _linearise(fn, state.trial, unravel, args)
        # Squares that overflow are as bad as no number.
        good = jnp.isfinite(jnp.sum(residual**2)) & jnp.isfinite(jnp.sum(jacobian**2))
        reduction = 0.5 * jnp.sum((state.residual - residual) * (state.residual + residual))
        gain = jnp.where(good, reduction / jnp.where(state.predicted > 0, state.predicted, 1.0), -jnp.inf)
        accept = good & (first | ((state.predicted > 0) & (gain > 1e-4)))
        residual = jnp.where(accept, residual, state.residual)
        jacobian = jnp.where(accept, jacobian, state.jacobian)
        point = jnp.where(accept, state.trial, before)
        aux = jax.tree.map(lambda new, old: jnp.where(accept, new, old), aux, state.aux)

        model = linear_model(residual, jacobian, lower - point, upper - point)
        columns = jnp.where(accept, _columns(state, model), state.columns)
        known = first | (state.size > 0)
        size = jnp.where(known, jnp.maximum(state.size, jnp.abs(point)), 0.0)
        # A step as long as the residual (its memory fades like that of the columns) changes no variable by more than
        # its own size.
        at_start = jnp.where(first, model.squares, 2 * state.history[0])
        scale = jnp.maximum(columns, (at_start * model.squares) ** 0.25 / jnp.where(size > 0, size, jnp.inf))
        weights = jnp.clip(jnp.where(model.seen, scale / model.norms, 1.0), 1.0, 1e50)
        moved = state.trial - before
        radius = jnp.where(
            first,
            self.initial_radius * jnp.sqrt(model.squares),
            _radius(state, gain, reduction, jnp.linalg.norm(state.scale * moved), jnp.linalg.norm(scale * moved)),
        )
        found = model.steps(weights, radius, state.damping)
        newton, z = found.newton, found.damped
        # Rounding must not leave the box, nor stop short of a bound.
        trial = jnp.clip(point + z / model.norms, lower, upper)
        trial = jnp.where(z == model.lower, lower, jnp.where(z == model.upper, upper, trial))
        predicted = 0.5 * model.promised(z)

        offset = jnp.sqrt(jnp.abs(model.promised(newton)) / jnp.where(model.squares > 0, model.squares, 1.0))
        reason = self._reason(model, point, newton, offset, ~accept, radius, predicted, at_start, residual.size)
        hopeless = first & ~good
        steps = state.steps + 1
        new_state = BoundedState(
            residual=residual,
            jacobian=jacobian,
            trial=trial,
            predicted=predicted,
            slope=model.slope(z),
            damping=found.damping,
            radius=radius,
            columns=columns,
            size=size,
            scale=scale,
            offset=jnp.where(hopeless, jnp.inf, offset),
            active=found.active,
            steps=steps,
            history=state.history.at[jnp.minimum(steps, self.history_length - 1)].set(
                jnp.where(hopeless, jnp.nan, 0.5 * model.squares)
            ),
            reason=Stop.where(hopeless, Stop.not_finite, reason),
            aux=aux,
        )
        return unravel(point), new_state, aux

    def _reason(
        self,
        model: LinearModel,
        point: Array,
        newton: Array,
        offset: Array,
        rejected: Array,
        radius: Array,
        predicted: Array,
        at_start: Array,
        rows: int,
    ) -> Stop:
        eps = jnp.finfo(point.dtype).eps
        # What rounding of the variables makes of the residual, and what the model would still change of it.
        rounding = 4 * eps * jnp.sum(jnp.where(model.seen, model.norms * jnp.abs(point), 0.0))
        change = offset * jnp.sqrt(model.squares)
        small = jnp.all(jnp.abs(newton) <= self.xtol * model.norms * jnp.abs(point))
        done = (offset <= self.rtol) | small | (model.squares <= self.atol**2)
        # A promised reduction of less than 1e-12 of the cost drowns in the rounding of a simulated residual.
        drowned = rejected & ((offset < 1e-6) | (change <= rounding))
        shortest = jnp.maximum(rounding, eps * jnp.sqrt(model.squares))
        stuck = drowned | (predicted <= 0) | (rejected & (radius <= shortest))
        # Where the Jacobian is singular the offset stays large, though the gradient is zero.
        level = (offset < 1e-5) | (change <= rounding) | (model.cosine() < 1e-6)
        # Nothing of the data is left, by their own weights and beside the start: the rest is rounding of the model.
        exact = (model.squares <= _EXACT**2 * rows) & (model.squares <= _LEFT**2 * at_start)
        # A residual that nothing moves is no minimum.
        movable = model.lower < model.upper
        blind = jnp.any(movable) & ~jnp.any(movable & model.seen) & (model.squares > self.atol**2)
        reason = Stop.where(stuck, Stop.where(level | exact, Stop.at_precision, Stop.stalled), Stop.running)
        return Stop.where(blind, Stop.stalled, Stop.where(done, Stop.converged, reason))

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


def _columns(state: BoundedState, model: LinearModel) -> Array:
    """Column norms now or, as far as the cost has not fallen since, before."""
    squares = jnp.sum(state.residual**2)
    fall = jnp.where(squares > 0, model.squares / jnp.where(squares > 0, squares, 1.0), 1.0)
    return jnp.maximum(jnp.where(model.seen, model.norms, 0.0), state.columns * jnp.minimum(fall, 1.0) ** 0.25)


def _radius(state: BoundedState, gain: Array, reduction: Array, length: Array, now: Array) -> Array:
    """The next radius from how well the last step, of some length then and now, kept its promise (Moré 1978, §4)."""
    # Minimiser of the parabola through the cost, its slope and the cost after the step.
    bend = jnp.minimum(state.slope + reduction, -1e-300)
    cut = jnp.where(reduction < 0, jnp.clip(0.5 * state.slope / bend, 0.1, 0.5), 0.5)
    cut = jnp.where(jnp.isfinite(gain), cut, 0.25)
    shrunk = cut * jnp.minimum(state.radius, 10 * length)
    # The length of one and the same step changes with the scale.
    kept = state.radius * now / jnp.where(length > 0, length, 1.0)
    shrunk = jnp.where(gain > 0, shrunk * now / jnp.where(length > 0, length, 1.0), shrunk)
    trusted = (gain >= 0.75) | (state.damping == 0)
    return jnp.where(gain <= 0.25, shrunk, jnp.where(trusted, 2 * now, kept))
