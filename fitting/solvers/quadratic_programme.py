"""Small strictly convex quadratic programmes by a dual active set, written out in JAX: no LAPACK call, fixed shapes."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from fitting.solvers.factor import inverse_of_lower


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
    """Size of what the step is summed up from, which its rounding is relative to."""
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
    inverse: Float[Array, "n n"]
    """W with W·Jᵀ·N = I for the active normals N: one row a slot, zero beyond `filled`."""
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
    all_offsets = jnp.append(offsets, 0.0)
    number = jnp.arange(rows)

    def body(state: _State) -> _State:
        fresh = state.entering < 0
        inside = slot < state.filled
        # Between two constraints the step follows from the active ones alone. Summed up instead, it would keep the
        # rounding of a free minimum that can be very far away.
        target = jnp.where(inside, -state.sign * all_offsets[state.active], 0.0)
        part = jnp.where(inside, target @ state.inverse, -(gradient @ state.basis))
        step = jnp.where(fresh, state.basis @ part, state.step)
        reach = jnp.where(fresh, jnp.abs(state.basis) @ jnp.abs(part), state.reach)
        slack = all_normals[:rows] @ step + offsets
        rounding = 1e-14 * (jnp.abs(all_normals[:rows]) @ reach + jnp.abs(offsets)) + 1e-300

        # Choose: the equalities one by one, then the inequality violated most.
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
        rest = jnp.where(inside, 0.0, image)
        curvature = jnp.sum(rest**2)
        dependent = curvature <= 1e-24 * jnp.sum(image**2)
        direction = state.basis @ rest
        change = state.inverse @ image

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
        step = step + jnp.where(dependent, 0.0, length) * direction
        duals = jnp.where(inside, state.dual - length * change, 0.0)
        dual = dual + length

        basis, inverse = _updated(state, image, change, leaving, adds, drops)
        last = slot == state.filled
        behind = jnp.where(slot >= leaving, 1, 0)
        following = jnp.minimum(slot + behind, n - 1)

        def shifted(values: Array, empty: float | int) -> Array:
            return jnp.where(slot + 1 >= state.filled, jnp.where(behind == 1, empty, values), values[following])

        def pick(add: Array, drop: Array, keep: Array) -> Array:
            return jnp.where(adds, add, jnp.where(drops, drop, keep))

        settled = nothing | stuck
        return _State(
            step=step,
            reach=jnp.maximum(reach, jnp.abs(step)),
            dual=pick(jnp.where(last, dual, duals), shifted(duals, 0.0), duals),
            active=pick(jnp.where(last, p, state.active), shifted(state.active, rows), state.active),
            sign=pick(jnp.where(last, sign, state.sign), shifted(state.sign, 1.0), state.sign),
            filled=state.filled + jnp.where(adds, 1, 0) - jnp.where(drops, 1, 0),
            basis=basis,
            inverse=inverse,
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
        inverse=jnp.zeros((n, n)),
        entering=jnp.asarray(-1),
        entering_dual=zero,
        entering_sign=zero + 1.0,
        equalities=jnp.asarray(0),
        done=jnp.asarray(skip) | ~jnp.all(jnp.isfinite(free)),
        feasible=jnp.asarray(True),
        turns=jnp.asarray(0),
    )
    end = jax.lax.while_loop(lambda s: ~s.done & (s.turns < limit), body, start)
    step, dual = _refined(end, gradient, all_normals, all_offsets)
    every = jnp.zeros(rows + 1).at[end.active].add(end.sign * dual)
    return QuadraticSolution(
        step=jnp.where(skip, 0.0, jnp.clip(step, lower, upper)),
        multipliers=every[:m],
        bound_multipliers=every[m : m + n] - every[m + n : rows],
        feasible=end.feasible & end.done & jnp.all(jnp.isfinite(step)),
    )


def _updated(
    state: _State, image: Array, change: Array, leaving: Array, adds: Array, drops: Array
) -> tuple[Array, Array]:
    """J and W after a constraint joined, left, or neither.

    One reflection does either: it turns what the new normal has beyond the active ones onto the next axis, or the
    leaving constraint's row of W, which is at right angles to all other active normals, onto the last one.
    """
    slot = jnp.arange(image.size)
    row = state.inverse[leaving]
    vector = jnp.where(drops, row, jnp.where(slot >= state.filled, image, 0.0))
    axis = slot == state.filled - jnp.where(drops, 1, 0)
    largest = jnp.max(jnp.abs(vector))
    vector = vector / jnp.where(largest > 0, largest, 1.0)
    head, norm = jnp.sum(jnp.where(axis, vector, 0.0)), jnp.sqrt(jnp.sum(vector**2))
    turned = jnp.where(head >= 0, -norm, norm)
    vector = vector - jnp.where(axis, turned, 0.0)
    square = jnp.sum(vector**2)
    usable = (adds | drops) & (square > 0)
    scale = jnp.where(usable, 2.0 / jnp.where(usable, square, 1.0), 0.0)
    both = jnp.concatenate([state.basis, state.inverse])
    both = both - scale * jnp.outer(both @ vector, vector)
    basis, inverse = both[: image.size], both[image.size :]
    length = jnp.where(adds, turned * largest, 1.0)
    joined = inverse + jnp.outer(jnp.where(axis, 1.0, -change), jnp.where(axis, 1.0 / length, 0.0))
    above = jnp.where(slot[:, None] >= leaving, jnp.roll(inverse, -1, axis=0), inverse)
    left = jnp.where((slot[:, None] + 1 < state.filled) & ~axis, above, 0.0)
    return basis, jnp.where(adds, joined, jnp.where(drops, left, inverse))


def _refined(end: _State, gradient: Array, normals: Array, offsets: Array) -> tuple[Array, Array]:
    """Step and multipliers straight from the active set: the path's rounding is left behind."""
    inside = jnp.arange(gradient.size) < end.filled
    # Jᵀ·N, whose inverse is known up to the rounding of many updates.
    active = end.basis.T @ (end.sign[:, None] * normals[end.active]).T
    active = jnp.where(inside[:, None] & inside[None, :], active, 0.0)

    def solved(matrix: Array, inverse: Array, target: Array) -> Array:
        x = inverse @ target
        for _ in range(2):
            x = x + inverse @ (target - matrix @ x)
        return x

    target = jnp.where(inside, -offsets[end.active] * end.sign, 0.0)
    along = solved(active.T, end.inverse.T, target)
    pull = end.basis.T @ gradient
    step = end.basis @ jnp.where(inside, along, -pull)
    dual = solved(active, end.inverse, jnp.where(inside, along + pull, 0.0))
    # An inequality that pushes by rounding alone does not push.
    return step, jnp.where(end.dual == 0, jnp.maximum(dual, 0.0), dual)
