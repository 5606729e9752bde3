"""Where SLSQP goes next: the direction from the quadratic model, and how that model learns."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from fitting.solvers.factor import inverse_of_lower, triangular_factor
from fitting.solvers.quadratic_programme import QuadraticSolution, quadratic_programme


class Evaluation(NamedTuple):
    """Objective and constraints at a point, with their derivatives."""

    value: Float[Array, ""]
    """Objective f."""
    gradient: Float[Array, "variables"]
    """∇f."""
    constraints: Float[Array, "constraints"]
    """c, equalities first."""
    normals: Float[Array, "constraints variables"]
    """∂c/∂x."""


class Plan(NamedTuple):
    """A direction, and what is known about it."""

    direction: Float[Array, "variables"]
    """d."""
    slope: Float[Array, ""]
    """Slope of the merit function along d."""
    multipliers: Float[Array, "constraints"]
    """λ of the constraints."""
    bound_multipliers: Float[Array, "variables"]
    """Multipliers of the bounds."""
    penalties: Float[Array, "constraints"]
    """Weights of the violations in the merit function."""
    promised: Float[Array, ""]
    """Reduction of the Lagrangian that the model promises."""
    restoring: Bool[Array, ""]
    """Whether d reduces the violation only."""
    stuck: Bool[Array, ""]
    """Whether it cannot even do that."""
    detour: Bool[Array, ""]
    """Whether d leaves a point where the violation is stationary, along the objective."""


def plan_direction(
    here: Evaluation,
    factor: Array,
    penalties: Array,
    lower: Array,
    upper: Array,
    point: Array,
    equalities: int,
    skip: Array,
    may_detour: Array,
) -> Plan:
    """Next direction: from the linearised constraints, else from relaxed ones, else of the violation alone.

    Args:
        here: objective and constraints at the point.
        factor: L of the quadratic model.
        penalties: weights of the violations so far.
        lower: lower bounds minus the point.
        upper: upper bounds minus the point.
        point: the point, which sets how far a step that reduces the violation may go.
        equalities: number of equalities.
        skip: whether the answer is not needed.
        may_detour: whether a stationary violation may be left along the objective.
    """
    n, m = here.gradient.size, here.constraints.size
    breached = is_violated(here.constraints, equalities)
    breach = jnp.where(breached, here.constraints, 0.0)
    # One more unknown, the share δ of the violation that is forgiven: held at 0, up to 1, or left out of account. One
    # programme for the three keeps compilation short.
    extra = 1 if m else 0
    dear = 1e3 * jnp.sqrt(1.0 + jnp.sum((inverse_of_lower(factor) @ here.gradient) ** 2))
    gradient = jnp.append(here.gradient, jnp.zeros(extra))
    normals = jnp.concatenate([here.normals, -breach[:, None]], axis=1) if m else here.normals

    def attempt(stage: Array, counted: Array) -> QuadraticSolution:
        """δ = 0 (stage 0), 0 ≤ δ ≤ 1 (stage 1: Kraft's relaxation), least squares of the violation (from stage 2)."""
        if not m:
            return quadratic_programme(factor, gradient, normals, here.constraints, lower, upper, skip=skip)
        alone = stage >= 2
        reach = jnp.where(alone, jnp.maximum(1.0, jnp.abs(point)), jnp.inf)
        rows = jnp.where(counted[:, None], here.normals, 0.0)
        damping = 1e-6 * jnp.sqrt(jnp.sum(rows**2) + 1e-300)
        least = triangular_factor(jnp.concatenate([rows, damping * jnp.eye(n)])).T
        return quadratic_programme(
            jnp.zeros((n + 1, n + 1)).at[:n, :n].set(jnp.where(alone, least, factor)).at[n, n].set(dear),
            jnp.where(alone, jnp.append(here.constraints @ rows, 0.0), gradient),
            jnp.where(alone, 0.0, normals),
            jnp.where(alone, 0.0, here.constraints),
            jnp.append(jnp.maximum(lower, -reach), 0.0),
            jnp.append(jnp.minimum(upper, reach), jnp.where(stage == 1, 1.0, 0.0)),
            equalities=equalities,
            skip=skip,
        )

    def turn(carry: tuple) -> tuple:
        stage, counted, _, before, _ = carry
        answer = attempt(stage, counted)
        forgiven = answer.step[n] > 1 - 1e-3 if m else jnp.asarray(False)
        # What the step would breach joins in, so that constraints against each other meet in the middle.
        more = counted | is_violated(here.constraints + here.normals @ answer.step[:n], equalities)
        settled = jnp.all(more == counted) | (stage > m + 2)
        fine = jnp.where(stage < 2, answer.feasible & ~forgiven, settled)
        relaxed = jax.tree.map(lambda new, old: jnp.where(stage < 2, new, old), answer, before)
        return stage + jnp.where(fine, 0, 1), jnp.where(stage < 2, counted, more), answer, relaxed, fine

    none = QuadraticSolution(jnp.zeros(n + extra), jnp.zeros(m), jnp.zeros(n + extra), jnp.asarray(True))
    begin = (jnp.asarray(0), breached, none, none, jnp.asarray(skip))
    stage, _, answer, relaxed, _ = jax.lax.while_loop(lambda carry: ~carry[4], turn, begin)
    size = jnp.sum(breach**2)
    left = jnp.sum(violations(here.constraints + here.normals @ answer.step[:n], equalities) ** 2)
    stationary = (stage >= 2) & (size - left <= 1e-8 * size)
    # A stationary violation may be a saddle: going down the objective where the violation is level leaves it.
    level = jnp.abs(here.gradient @ relaxed.step[:n]) > 1e-8 * (1.0 + jnp.abs(here.value))
    detour = stationary & may_detour & relaxed.feasible & level
    answer = jax.tree.map(lambda one, other: jnp.where(detour, one, other), relaxed, answer)
    direction, restoring = answer.step[:n], (stage >= 2) & ~detour
    absolute = jnp.abs(answer.multipliers)
    kept = skip | restoring
    penalties = jnp.where(kept, penalties, jnp.maximum(absolute, (penalties + absolute) / 2))
    along = here.gradient @ direction
    after = here.constraints + here.normals @ direction
    slope = along - jnp.sum(penalties * (jnp.abs(breach) - violations(after, equalities)))
    return Plan(
        direction=direction,
        slope=jnp.where(restoring, breach @ here.normals @ direction, slope),
        multipliers=jnp.where(kept, 0.0, answer.multipliers),
        bound_multipliers=answer.bound_multipliers[:n],
        penalties=penalties,
        promised=jnp.abs(along) + jnp.sum(absolute * jnp.abs(breach)),
        restoring=restoring,
        stuck=restoring & stationary,
        detour=detour,
    )


def updated_factor(
    factor: Float[Array, "variables variables"], step: Float[Array, "variables"], change: Float[Array, "variables"]
) -> Float[Array, "variables variables"]:
    """L after BFGS with Powell's damping, from the step and the change of the Lagrangian's gradient.

    B - B·s·sᵀ·B/(sᵀ·B·s) + y·yᵀ/(yᵀ·s) is L·(I - w·wᵀ/wᵀw)·Lᵀ + y·yᵀ/(yᵀ·s) with w = Lᵀ·s: a product of a factor with
    one more column than L, which reflections turn back into a triangle. B is never formed, and stays positive.

    Args:
        factor: L of B.
        step: s.
        change: y.
    """
    w = factor.T @ step
    curvature, seen = jnp.sum(w**2), step @ change
    image = factor @ w
    share = jnp.where(seen < 0.2 * curvature, 0.8 * curvature / (curvature - seen), 1.0)
    change = share * change + (1 - share) * image
    rest = factor - jnp.outer(image, w) / curvature
    new = triangular_factor(jnp.concatenate([rest.T, (change / jnp.sqrt(step @ change))[None]])).T
    # A curvature that is rounding beside the variable's own would make the next programme rounding as well.
    floor = 1e-6 * jnp.sqrt(jnp.sum(new**2, axis=1))
    return new + jnp.diag(jnp.maximum(floor - jnp.diag(new), 0.0))


def is_violated(constraints: Array, equalities: int) -> Bool[Array, "constraints"]:
    """Which constraints do not hold; equalities always count as not holding."""
    return (jnp.arange(constraints.size) < equalities) | (constraints < 0)


def violations(constraints: Array, equalities: int) -> Float[Array, "constraints"]:
    """By how much each constraint is violated."""
    equal = jnp.arange(constraints.size) < equalities
    return jnp.where(equal, jnp.abs(constraints), jnp.maximum(-constraints, 0.0))


def largest_violation(constraints: Array, equalities: int) -> Float[Array, ""]:
    """The largest violation; zero without constraints."""
    return jnp.max(violations(constraints, equalities), initial=0.0)
