"""Derivatives of a solution with respect to what the problem depends on, by the implicit function theorem."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, PyTree

from fitting.solvers.levenberg_marquardt import BoundedLevenbergMarquardt, BoundedState
from fitting.solvers.slsqp import SLSQP, SLSQPState
from fitting.solvers.stop import Stop


def solution_of(
    fn: Any,
    solver: BoundedLevenbergMarquardt | SLSQP,
    start: Float[Array, "variables"],
    args: PyTree[Any],
    *,
    options: dict | None = None,
    max_steps: int = 256,
) -> tuple[Float[Array, "variables"], Bool[Array, ""]]:
    """The solution of a problem, differentiable with respect to `args` in forward and reverse mode.

    At a solution the gradient of the Lagrangian is zero, and stays so as the problem changes; what is active stays
    active. So dy = -K⁻¹·(∂²L/∂y∂args)·dargs, with K the matrix of the Karush-Kuhn-Tucker conditions (A. V. Fiacco,
    Mathematical Programming 10 (1976) 287-311). The steps of the solver are not differentiated. Where the solver did
    not converge the theorem says nothing, and the derivative is NaN rather than a plausible number. It holds where the
    second-order conditions do and no multiplier of an active constraint is zero.

    Args:
        fn: function of (y, args): the residual for Levenberg-Marquardt, the objective for SLSQP.
        solver: the solver.
        start: first y; the solution does not depend on it.
        args: arrays that the problem depends on, in any structure.
        options: of the solver: bounds, constraints. Bounds are taken as constant.
        max_steps: as in `optimistix`.

    Returns:
        The solution, and whether the solver converged.
    """
    chosen = {} if options is None else dict(options)
    least_squares = isinstance(solver, BoundedLevenbergMarquardt)
    dynamic, fixed = eqx.partition(args, eqx.is_inexact_array)
    # Arrays go in as arguments: what a rule for derivatives closes over must not be traced.
    constant, static = eqx.partition((fixed, start, chosen), eqx.is_array)

    def unpacked(dynamic: PyTree, constant: PyTree) -> tuple[PyTree, Array, dict]:
        fixed, start, options = eqx.combine(constant, static)
        return eqx.combine(dynamic, fixed), start, options

    def constraints(y: Array, dynamic: PyTree, constant: PyTree) -> Array:
        own, _, options = unpacked(dynamic, constant)
        parts = [options[name](y, own) for name in ("equality", "inequality") if options.get(name) is not None]
        return jnp.concatenate([jnp.zeros(0), *(jnp.ravel(part) for part in parts)])

    def cost(y: Array, dynamic: PyTree, constant: PyTree) -> Array:
        value = fn(y, unpacked(dynamic, constant)[0])
        return 0.5 * jnp.sum(value**2) if least_squares else jnp.reshape(value, ())

    @jax.custom_jvp
    def solve(dynamic: PyTree, constant: PyTree) -> tuple[Array, Array, Array, Array, Array]:
        own, start, options = unpacked(dynamic, constant)
        y, state = _iterate(fn, solver, start, own, options, max_steps)
        converged = (state.reason == Stop.converged) | (state.reason == Stop.at_precision)
        multipliers = jnp.zeros(0) if isinstance(state, BoundedState) else state.multipliers
        equalities = options["equality"](start, own).size if options.get("equality") is not None else 0
        holds = (jnp.arange(multipliers.size) < equalities) | (multipliers > 0)
        return y, converged, state.active, multipliers, holds

    @solve.defjvp
    def solve_jvp(primals: tuple, tangents: tuple) -> tuple:
        (dynamic, constant), (change, _) = primals, tangents
        y, converged, active, multipliers, holds = solve(dynamic, constant)

        def gradient(y: Array, dynamic: PyTree) -> Array:
            # Forward mode twice: what is simulated need not support reverse mode.
            def lagrangian(x: Array) -> Array:
                return cost(x, dynamic, constant) - multipliers @ constraints(x, dynamic, constant)

            return jax.jacfwd(lagrangian)(y)

        hessian = jax.jacfwd(gradient)(y, dynamic)
        normals = jax.jacfwd(constraints)(y, dynamic, constant)
        _, moved = jax.jvp(lambda d: gradient(y, d), (dynamic,), (change,))
        _, shifted = jax.jvp(lambda d: constraints(y, d, constant), (dynamic,), (change,))
        n = y.size
        # A held variable and a constraint that does not hold have the equation "does not move".
        kept, live = ~active, holds
        matrix = jnp.block(
            [
                [jnp.where(kept[:, None], hessian, jnp.eye(n)), jnp.where(kept[:, None], -normals.T, 0.0)],
                [jnp.where(live[:, None], normals, 0.0), jnp.diag(jnp.where(live, 0.0, 1.0))],
            ]
        )
        right = jnp.concatenate([jnp.where(kept, -moved, 0.0), jnp.where(live, -shifted, 0.0)])
        # A gate that multiplies, so that it is linear and can be transposed.
        gate = jnp.where(converged, 1.0, jnp.nan)
        solved = gate * jnp.linalg.solve(matrix, right)[:n]
        still = [np.zeros(x.shape, jax.dtypes.float0) for x in (converged, active, holds)]
        return (y, converged, active, multipliers, holds), (solved, *still[:2], jnp.zeros_like(multipliers), still[2])

    y, converged, *_ = solve(dynamic, constant)
    return y, converged


def _iterate(
    fn: Any, solver: BoundedLevenbergMarquardt | SLSQP, start: Array, args: PyTree, options: dict, max_steps: int
) -> tuple[Array, BoundedState | SLSQPState]:
    """The solver's own steps, without optimistix's rule for derivatives, which knows of no bounds."""

    def with_aux(y: Array, args: PyTree) -> tuple[Array, None]:
        return fn(y, args), None

    shape = eqx.filter_eval_shape(fn, start, args)
    first: Any = solver.init(with_aux, start, args, options, shape, None, frozenset())

    def body(carry: tuple) -> tuple:
        y, state, _ = solver.step(with_aux, carry[0], args, options, carry[1], frozenset())
        return y, state

    def unfinished(carry: tuple) -> Array:
        return (carry[1].reason == Stop.running) & (carry[1].steps < max_steps)

    return jax.lax.while_loop(unfinished, body, (start, first))
