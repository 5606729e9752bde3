"""Small strictly convex quadratic programmes by a dual active set, written out in JAX: no LAPACK call, fixed shapes."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from fitting.solvers.factor import inverse_of_lower, solve_upper


class QuadraticSolution(NamedTuple):
    """Minimum of a quadratic programme."""

    step: Float[Array, "variables"]
    """Minimising d."""
    multipliers: Float[Array, "constraints"]
    """Multipliers λ of the general constraints: B·d + g = Cᵀλ + bound multipliers; not negative for inequalities."""
    bound_multipliers: Float[Array, "variables"]
    """Multipliers of the bounds: positive at a lower bound, negative at an upper one."""
    feasible: Bool[Array, ""]
    """Whether the constraints have a common point."""


class _State(NamedTuple):
    step: Float[Array, "n"]
    reach: Float[Array, "n"]
    """Largest size of each variable so far."""
    dual: Float[Array, "n"]
    """Multipliers of the active constraints, by slot."""
    active: Int[Array, "n"]
    """Which constraint is in which slot; the rows' number where none is."""
    sign: Float[Array, "n"]
    """Side from which an equality was entered, by slot."""
    filled: Int[Array, ""]
    """Active constraints."""
    basis: Float[Array, "n n"]
    """J with J·Jᵀ = B⁻¹; its first columns span the active normals in the metric of B."""
    triangle: Float[Array, "n n"]
    """R of the active normals: Jᵀ·N = [R; 0]."""
    entering: Int[Array, ""]
    """Constraint that is being added; -1 between two."""
    entering_dual: Float[Array, ""]
    entering_sign: Float[Array, ""]
    equalities: Int[Array, ""]
    """Equalities dealt with."""
    done: Bool[Array, ""]
    feasible: Bool[Array, ""]
    turns: Int[Array, ""]


def quadratic_programme(
    factor: Float[Array, "variables variables"],
    gradient: Float[Array, "variables"],
    normals: Float[Array, "constraints variables"],
    values: Float[Array, "constraints"],
    lower: Float[Array, "variables"],
    upper: Float[Array, "variables"],
    *,
    equalities: int = 0,
    skip: Bool[Array, ""] | bool = False,
) -> QuadraticSolution:
    """min ½·dᵀB·d + gᵀd subject to C·d + c = 0 or ≥ 0 and lower ≤ d ≤ upper, with B = L·Lᵀ.

    The dual method of D. Goldfarb and A. Idnani, "A numerically stable dual method for solving strictly convex
    quadratic programs", Mathematical Programming 27 (1983) 1-33: it starts at the free minimum and adds the constraint
    that is violated most, so it needs no feasible start and tells when there is none.

    Args:
        factor: L, lower triangular, diagonal positive.
        gradient: g.
        normals: C, the equalities first.
        values: c.
        lower: lower bounds, -∞ where there is none.
        upper: upper bounds, ∞ where there is none.
        equalities: number of equalities.
        skip: whether to leave out the work and return zeros: lanes of a batch that do not need the answer.

    Returns:
        The minimum with its multipliers; where not feasible, the last point.
    """
    n, m = gradient.size, values.size
    rows = m + 2 * n
    slot = jnp.arange(n)
    eye = jnp.eye(n)
    basis = inverse_of_lower(factor).T
    free = -basis @ (basis.T @ gradient)
    all_normals = jnp.concatenate([normals, eye, -eye, jnp.zeros((1, n))])
    size = jnp.sqrt(jnp.sum(all_normals[:rows] ** 2, axis=1))
    size = jnp.where(size > 0, size, 1.0)
    offsets = jnp.concatenate([values, -lower, upper])
    number = jnp.arange(rows)

    def body(state: _State) -> _State:
        slack = all_normals[:rows] @ state.step + offsets
        # The free minimum can be far away, and its rounding stays in every later step.
        rounding = 1e-14 * (jnp.abs(all_normals[:rows]) @ state.reach + jnp.abs(offsets)) + 1e-300

        # Choose: the equalities one by one, then the inequality violated most.
        fresh = state.entering < 0
        is_active = jnp.any(state.active[None, :] == number[:, None], axis=1)
        violation = jnp.where((number >= equalities) & ~is_active, -slack / size, -jnp.inf)
        violation = jnp.where(-slack > rounding, violation, -jnp.inf)
        worst = jnp.argmax(violation)
        chosen = jnp.where(state.equalities < equalities, state.equalities, worst)
        nothing = fresh & (state.equalities >= equalities) & ~(violation[worst] > -jnp.inf)
        p = jnp.where(fresh, chosen, state.entering)
        sign = jnp.where(fresh, jnp.where((p < equalities) & (slack[p] > 0), -1.0, 1.0), state.entering_sign)
        dual = jnp.where(fresh, 0.0, state.entering_dual)

        normal = sign * all_normals[p]
        miss = sign * slack[p]
        image = state.basis.T @ normal
        inside = slot < state.filled
        rest = jnp.where(inside, 0.0, image)
        curvature = jnp.sum(rest**2)
        dependent = curvature <= 1e-24 * jnp.sum(image**2)
        direction = state.basis @ rest
        triangle = jnp.where(inside[:, None] & inside[None, :], state.triangle, eye)
        change = solve_upper(triangle, jnp.where(inside, image, 0.0))

        may_leave = inside & (state.active >= equalities) & (change > 0)
        ratio = jnp.where(may_leave, state.dual / jnp.where(may_leave, change, 1.0), jnp.inf)
        leaving = jnp.argmin(ratio)
        dual_length = ratio[leaving]
        full_length = jnp.where(dependent, jnp.inf, -miss / jnp.where(dependent, 1.0, curvature))
        length = jnp.minimum(dual_length, full_length)

        redundant = dependent & (p < equalities) & (jnp.abs(miss) <= 1e4 * rounding[p])
        stuck = ~nothing & ~redundant & ~jnp.isfinite(length)
        moves = ~nothing & ~redundant & ~stuck
        length = jnp.where(moves, length, 0.0)
        adds = moves & (full_length <= dual_length)
        drops = moves & ~adds
        step = state.step + jnp.where(dependent, 0.0, length) * direction
        duals = jnp.where(inside, state.dual - length * change, 0.0)
        dual = dual + length

        added_basis, column = _reflect(state.basis, image, state.filled)
        last = slot == state.filled
        dropped_basis, dropped_triangle = _drop(state.basis, state.triangle, leaving, state.filled)
        behind = jnp.where(slot >= leaving, 1, 0)
        following = jnp.minimum(slot + behind, n - 1)

        def shifted(values: Array, empty: Array | float) -> Array:
            return jnp.where(slot + 1 >= state.filled, jnp.where(behind == 1, empty, values), values[following])

        def pick(add: Array, drop: Array, keep: Array) -> Array:
            return jnp.where(adds, add, jnp.where(drops, drop, keep))

        settled = nothing | stuck
        return _State(
            step=step,
            reach=jnp.maximum(state.reach, jnp.abs(step)),
            dual=pick(jnp.where(last, dual, duals), shifted(duals, 0.0), duals),
            active=pick(jnp.where(last, p, state.active), shifted(state.active, rows), state.active),
            sign=pick(jnp.where(last, sign, state.sign), shifted(state.sign, 1.0), state.sign),
            filled=state.filled + jnp.where(adds, 1, 0) - jnp.where(drops, 1, 0),
            basis=pick(added_basis, dropped_basis, state.basis),
            triangle=pick(jnp.where(last[None, :], column[:, None], state.triangle), dropped_triangle, state.triangle),
            entering=jnp.where(drops, p, -1),
            entering_dual=dual,
            entering_sign=sign,
            equalities=state.equalities + jnp.where((adds | redundant) & (p < equalities), 1, 0),
            done=settled,
            feasible=~stuck,
            turns=state.turns + 1,
        )

    limit = 10 * (rows + 1)
    zero = jnp.zeros(())
    start = _State(
        step=free,
        reach=jnp.abs(free),
        dual=jnp.zeros(n),
        active=jnp.full(n, rows),
        sign=jnp.ones(n),
        filled=jnp.asarray(0),
        basis=basis,
        triangle=eye,
        entering=jnp.asarray(-1),
        entering_dual=zero,
        entering_sign=zero + 1.0,
        equalities=jnp.asarray(0),
        done=jnp.asarray(skip) | ~jnp.all(jnp.isfinite(free)),
        feasible=jnp.asarray(True),
        turns=jnp.asarray(0),
    )
    end = jax.lax.while_loop(lambda s: ~s.done & (s.turns < limit), body, start)
    step, dual = _refined(end, gradient, all_normals, jnp.append(offsets, 0.0))
    every = jnp.zeros(rows + 1).at[end.active].add(end.sign * dual)
    return QuadraticSolution(
        step=jnp.where(skip, 0.0, jnp.clip(step, lower, upper)),
        multipliers=every[:m],
        bound_multipliers=every[m : m + n] - every[m + n : rows],
        feasible=end.feasible & end.done & jnp.all(jnp.isfinite(step)),
    )


def _refined(end: _State, gradient: Array, normals: Array, offsets: Array) -> tuple[Array, Array]:
    """Step and multipliers straight from the active set: the path's rounding is left behind."""
    n = gradient.size
    inside = jnp.arange(n) < end.filled
    triangle = jnp.where(inside[:, None] & inside[None, :], end.triangle, jnp.eye(n))
    target = jnp.where(inside, -offsets[end.active] * end.sign, 0.0)
    along = jnp.where(inside, solve_upper(triangle.T[::-1, ::-1], target[::-1])[::-1], 0.0)
    pull = end.basis.T @ gradient
    step = end.basis @ jnp.where(inside, along, -pull)
    dual = jnp.where(inside, solve_upper(triangle, jnp.where(inside, along + pull, 0.0)), 0.0)
    # An inequality that pushes by rounding alone does not push.
    return step, jnp.where(end.dual == 0, jnp.maximum(dual, 0.0), dual)


def _reflect(basis: Array, image: Array, count: Array) -> tuple[Array, Array]:
    """J after the reflection that turns the part of Jᵀn beyond `count` onto one axis, and Jᵀn after it."""
    slot = jnp.arange(image.size)
    below = jnp.where(slot >= count, image, 0.0)
    head = jnp.sum(jnp.where(slot == count, image, 0.0))
    norm = jnp.sqrt(jnp.sum(below**2))
    turned = jnp.where(head >= 0, -norm, norm)
    vector = below - jnp.where(slot == count, turned, 0.0)
    square = jnp.sum(vector**2)
    scale = jnp.where(square > 0, 2.0 / jnp.where(square > 0, square, 1.0), 0.0)
    column = jnp.where(slot < count, image, jnp.where(slot == count, turned, 0.0))
    return basis - scale * jnp.outer(basis @ vector, vector), column


def _drop(basis: Array, triangle: Array, leaving: Array, count: Array) -> tuple[Array, Array]:
    """J and R without the active constraint in one slot: rotations chase the subdiagonal away."""
    n = triangle.shape[0]
    column = jnp.arange(n)
    shifted = jnp.where(column[None, :] >= leaving, jnp.roll(triangle, -1, axis=1), triangle)

    def rotate(k: Array, carry: tuple[Array, Array]) -> tuple[Array, Array]:
        r, q = carry
        a, b = r[k, k], r[k + 1, k]
        length = jnp.hypot(a, b)
        needed = (k >= leaving) & (k < count - 1) & (length > 0)
        c = jnp.where(needed, a / jnp.where(needed, length, 1.0), 1.0)
        s = jnp.where(needed, b / jnp.where(needed, length, 1.0), 0.0)
        upper_row, lower_row = r[k], r[k + 1]
        r = r.at[k].set(c * upper_row + s * lower_row).at[k + 1].set(c * lower_row - s * upper_row)
        left, right = q[:, k], q[:, k + 1]
        q = q.at[:, k].set(c * left + s * right).at[:, k + 1].set(c * right - s * left)
        return r, q

    new_triangle, new_basis = jax.lax.fori_loop(0, n - 1, rotate, (shifted, basis))
    return new_basis, new_triangle
