"""Sequential least-squares quadratic programming for small dense problems, as an optimistix minimiser."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, ArrayLike, Bool, Float, Int, PyTree

from fitting.solvers.slsqp_plan import Evaluation, largest_violation, plan_direction, updated_factor, violations
from fitting.solvers.stop import Stop


class SLSQPState(eqx.Module):
    """State of the SLSQP solver: its best point so far and the line search that goes out from it."""

    here: Evaluation
    """Objective and constraints at y."""
    factor: Float[Array, "variables variables"]
    """L, lower triangular: B = L·Lᵀ stands for the Hessian of the Lagrangian."""
    direction: Float[Array, "variables"]
    """Search direction d."""
    length: Float[Array, ""]
    """Share of d that is tried next."""
    slope: Float[Array, ""]
    """Slope of the merit function along d."""
    multipliers: Float[Array, "constraints"]
    """λ of the constraints; not negative for inequalities."""
    bound_multipliers: Float[Array, "variables"]
    """Positive at a lower bound that holds, negative at an upper one."""
    penalties: Float[Array, "constraints"]
    """Weights of the violations in the merit function."""
    promised: Float[Array, ""]
    """Reduction of the Lagrangian that the quadratic model still promises."""
    violation: Float[Array, ""]
    """Largest violation of a constraint."""
    trials: Int[Array, ""]
    """Points tried along d."""
    fresh: Bool[Array, ""]
    """Whether B is as it was at the start, free of history."""
    restoring: Bool[Array, ""]
    """Whether only the violation is being reduced, as the linearised constraints contradict each other."""
    detours: Int[Array, ""]
    """Steps along the violation, taken where it is stationary, in the hope that it is a saddle."""
    active: Bool[Array, "variables"]
    """Which variables sit on a bound that holds them back."""
    steps: Int[Array, ""]
    """Evaluations so far, without the one of the start."""
    history: Float[Array, "history"]
    """Objective at y after each evaluation; NaN for those not made."""
    reason: Stop
    """Why it stopped, or `running`."""
    aux: PyTree[Array]
    """The objective's auxiliary output at y."""


class SLSQP(optx.AbstractMinimiser):
    """Minimisation under bounds and general equalities and inequalities, 1 to some 50 unknowns.

    D. Kraft's method ("A software package for sequential quadratic programming", DFVLR-FB 88-28, 1988): the quadratic
    model's Hessian is kept as a triangular factor, updated by BFGS with Powell's damping; the step is a least-squares
    problem in that factor under the linearised constraints; an L1 merit function decides how far to go along it. Where
    the linearised constraints contradict each other they are relaxed, and where that does not help the violation alone
    is reduced. Bounds are never left, not even by rounding, and no point outside is evaluated.

    `options` of `optimistix.minimise`: "lower", "upper" (in the structure of y); "equality", "inequality": functions of
    (y, args) that return an array that shall be 0, or ≥ 0; "in_aux": instead of these functions how many of each the
    objective's auxiliary output holds, a vector with the equalities first, computed together with it; "factor": a
    first L, for instance the triangular factor of a Gauss-Newton Hessian, transposed; "autodiff_mode": "fwd" (default:
    few unknowns) or "rev"; "together": whether values and derivatives are evaluated at once (for batches, which
    evaluate the derivatives of every trial anyway; by default those of a rejected trial are left out). One step is one
    evaluation.
    """

    rtol: float = 1e-10
    """Converged when the reduction that the quadratic model promises is below rtol·|f| + atol."""
    atol: float = 1e-12
    """See `rtol`; in the unit of the objective."""
    norm: Callable[[PyTree], Array] = optx.max_norm
    """Unused; part of optimistix's interface."""
    feasibility: float = 1e-8
    """Violation of a constraint, in the constraint's unit, that counts as none."""
    history_length: int = 256
    """Evaluations whose objective is kept."""

    def init(
        self, fn: Any, y: PyTree, args: PyTree, options: dict, f_struct: PyTree, aux_struct: PyTree, tags: Any
    ) -> SLSQPState:
        del fn, f_struct, tags
        flat, _ = ravel_pytree(y)
        n = flat.size
        equalities, inequalities = _sizes(options, y, args)
        m = equalities + inequalities
        zero = jnp.zeros(())
        # The start is evaluated by the first call of `step`: an objective is then compiled once, not twice.
        return SLSQPState(
            here=Evaluation(zero, jnp.zeros(n), jnp.zeros(m), jnp.zeros((m, n))),
            factor=jnp.eye(n),
            direction=jnp.zeros(n),
            length=zero,
            slope=zero,
            multipliers=jnp.zeros(m),
            bound_multipliers=jnp.zeros(n),
            penalties=jnp.zeros(m),
            promised=zero + jnp.inf,
            violation=zero + jnp.inf,
            trials=jnp.asarray(0),
            fresh=jnp.asarray(True),
            restoring=jnp.asarray(False),
            detours=jnp.asarray(0),
            active=jnp.zeros(n, dtype=bool),
            steps=jnp.asarray(-1),
            history=jnp.full(self.history_length, jnp.nan),
            reason=Stop.running,
            aux=jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), aux_struct),
        )

    def step(
        self, fn: Any, y: PyTree, args: PyTree, options: dict, state: SLSQPState, tags: Any
    ) -> tuple[PyTree, SLSQPState, PyTree]:
        del tags
        flat, unravel = ravel_pytree(y)
        lower, upper = _bounds(options, flat)
        equalities, _ = _sizes(options, y, args)
        first = state.steps < 0
        # Rounding in y + step must not leave the box.
        start = jnp.clip(flat, lower, upper)
        trial = jnp.where(first, start, jnp.clip(flat + state.length * state.direction, lower, upper))

        def evaluate(point: Array) -> tuple[Array, tuple[Array, PyTree]]:
            value, aux = fn(unravel(point), args)
            constraints = aux if "in_aux" in options else _constraints(options, unravel(point), args)
            values = jnp.concatenate([jnp.reshape(value, (1,)), constraints])
            return values, (values, aux)

        mode = jax.jacrev if options.get("autodiff_mode", "fwd") == "rev" else jax.jacfwd
        derivatives = mode(evaluate, has_aux=True)
        slopes, (values, aux) = derivatives(trial) if options.get("together") else (None, evaluate(trial)[1])
        merit = _merit(values, state.penalties, equalities, state.restoring)
        before = _merit(_stacked(state.here), state.penalties, equalities, state.restoring)
        change = merit - before
        expected = state.length * state.slope
        finite = jnp.all(jnp.isfinite(values))
        rounding = 4 * jnp.finfo(flat.dtype).eps * jnp.abs(before)
        good = finite & (first | (change <= 0.1 * expected + rounding))

        old = jnp.concatenate([state.here.gradient[None], state.here.normals])
        if slopes is None:
            # One evaluation on its own leaves out the derivatives of a rejected trial.
            jacobian = jax.lax.cond(good, lambda: derivatives(trial)[0], lambda: old)
        else:
            jacobian = jnp.where(good, slopes, old)
        smooth = jnp.all(jnp.isfinite(jacobian))
        accept = good & smooth
        there = Evaluation(values[0], jacobian[0], values[1:], jacobian[1:])
        here = jax.tree.map(lambda new, kept: jnp.where(accept, new, kept), there, state.here)
        aux = jax.tree.map(lambda new, kept: jnp.where(accept, new, kept), aux, state.aux)
        point = jnp.where(accept, trial, flat)

        # Rejected: the minimum of a parabola through what is known, at least a tenth.
        parabola = expected / jnp.where(expected < change, 2 * (expected - change), -1.0)
        shorter = state.length * jnp.where(finite & smooth, jnp.clip(parabola, 0.1, 0.5), 0.1)

        learnt = updated_factor(state.factor, trial - flat, _lagrangian(there, state) - _lagrangian(state.here, state))
        usable = accept & ~first & ~state.restoring & jnp.all(jnp.isfinite(learnt))
        factor = jnp.where(usable, learnt, state.factor)
        fresh = state.fresh & ~usable

        # A line search that fails on a B with history is tried again without it.
        small = jnp.all(jnp.abs(state.length * state.direction) <= 4e-16 * jnp.abs(flat) + 1e-300)
        uphill = state.slope >= 0
        failed = ~first & (small | (~accept & (uphill | (state.trials >= 20))))
        again = failed & ~state.fresh
        factor = jnp.where(again | (first & accept), _first_factor(options, here.gradient, point), factor)
        plan = plan_direction(
            here,
            factor,
            state.penalties,
            lower - point,
            upper - point,
            point,
            equalities,
            ~(accept | again),
            state.detours < 3,
        )
        planned = accept | again

        def keep(new: ArrayLike, kept: ArrayLike) -> Array:
            return jnp.where(planned, new, kept)

        violation = largest_violation(here.constraints, equalities)
        feasible = violation <= self.feasibility
        promised = keep(plan.promised, state.promised)
        enough = promised <= self.rtol * jnp.abs(here.value) + self.atol
        restoring = keep(plan.restoring, state.restoring)
        converged = planned & enough & feasible & ~restoring
        hopeless = planned & restoring & plan.stuck & ~feasible
        gave_up = failed & ~again
        at_precision = feasible & (promised <= 1e-6 * jnp.abs(here.value) + self.atol)
        reason = Stop.where(
            gave_up,
            Stop.where(feasible, Stop.where(at_precision, Stop.at_precision, Stop.stalled), Stop.infeasible),
            Stop.running,
        )
        reason = Stop.where(hopeless, Stop.infeasible, reason)
        reason = Stop.where(converged, Stop.converged, reason)
        reason = Stop.where(first & ~accept, Stop.not_finite, reason)
        steps = state.steps + 1
        return (
            unravel(jnp.where(first, start, point)),
            SLSQPState(
                here=here,
                factor=factor,
                direction=keep(plan.direction, state.direction),
                length=keep(1.0, shorter),
                slope=keep(plan.slope, state.slope),
                multipliers=keep(plan.multipliers, state.multipliers),
                bound_multipliers=keep(plan.bound_multipliers, state.bound_multipliers),
                penalties=keep(plan.penalties, state.penalties),
                promised=promised,
                violation=violation,
                trials=jnp.where(planned, 0, state.trials + 1),
                fresh=fresh | again,
                restoring=restoring,
                detours=state.detours + keep(jnp.where(plan.detour, 1, 0), 0),
                active=keep(plan.bound_multipliers, state.bound_multipliers) != 0,
                steps=steps,
                history=state.history.at[jnp.minimum(steps, self.history_length - 1)].set(here.value),
                reason=reason,
                aux=aux,
            ),
            aux,
        )

    def terminate(
        self, fn: Any, y: PyTree, args: PyTree, options: dict, state: SLSQPState, tags: Any
    ) -> tuple[Bool[Array, ""], optx.RESULTS]:
        del fn, y, args, options, tags
        diverged = (state.reason == Stop.stalled) | (state.reason == Stop.infeasible)
        result = optx.RESULTS.where(diverged, optx.RESULTS.nonlinear_divergence, optx.RESULTS.successful)
        result = optx.RESULTS.where(state.reason == Stop.not_finite, optx.RESULTS.nonfinite, result)
        return state.reason != Stop.running, result

    def postprocess(
        self, fn: Any, y: PyTree, aux: PyTree, args: PyTree, options: dict, state: SLSQPState, tags: Any, result: Any
    ) -> tuple[PyTree, PyTree, dict]:
        del fn, aux, args, options, tags, result
        # A start that is not finite ends the iteration before the first step.
        gave_up = Stop.where(state.steps < 0, Stop.not_finite, Stop.too_many_steps)
        reason = Stop.where(state.reason == Stop.running, gave_up, state.reason)
        return y, state.aux, {"reason": reason}


def _lagrangian(at: Evaluation, state: SLSQPState) -> Array:
    return at.gradient - state.multipliers @ at.normals


def _merit(values: Array, penalties: Array, equalities: int, restoring: Array) -> Array:
    breach = violations(values[1:], equalities)
    return jnp.where(restoring, 0.5 * jnp.sum(breach**2), values[0] + jnp.sum(penalties * breach))


def _stacked(at: Evaluation) -> Array:
    return jnp.concatenate([at.value[None], at.constraints])


def _constraints(options: dict, y: PyTree, args: PyTree) -> Array:
    parts = [jnp.ravel(options[name](y, args)) for name in ("equality", "inequality") if options.get(name) is not None]
    return jnp.concatenate([jnp.zeros(0), *parts])


def _sizes(options: dict, y: PyTree, args: PyTree) -> tuple[int, int]:
    if "in_aux" in options:
        return options["in_aux"]
    sizes = []
    for name in ("equality", "inequality"):
        function = options.get(name)
        sizes.append(0 if function is None else int(eqx.filter_eval_shape(function, y, args).size))
    return sizes[0], sizes[1]


def _first_factor(options: dict, gradient: Array, point: Array) -> Array:
    """L before anything is known of the curvature."""
    if options.get("factor") is not None:
        return jnp.asarray(options["factor"])
    # One, but where the unknowns are large or f is flat that would make steps, and promises, of next to nothing.
    relative = jnp.max(jnp.abs(gradient)) / jnp.maximum(1.0, jnp.max(jnp.abs(point)))
    return jnp.sqrt(jnp.clip(relative, 1e-20, 1.0)) * jnp.eye(gradient.size)


def _bounds(options: dict, flat: Float[Array, "variables"]) -> tuple[Array, Array]:
    lower, upper = options.get("lower"), options.get("upper")
    low = jnp.full_like(flat, -jnp.inf) if lower is None else ravel_pytree(lower)[0]
    high = jnp.full_like(flat, jnp.inf) if upper is None else ravel_pytree(upper)[0]
    return low, high
