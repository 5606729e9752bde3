"""The linear least-squares model of a residual within bounds, and its best step of a given length."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from fitting.solvers.dense import bounded_least_squares, orthogonal_triangle, pushed_on_bounds


class LinearModel(eqx.Module):
    """‖r + J·s‖ within bounds, in steps z = s·(column norms of J): no unit of a variable matters in what follows."""

    matrix: Float[Array, "variables variables"]
    """R of the QR factorisation of J with normalised columns."""
    projected: Float[Array, "variables"]
    """Qᵀr."""
    norms: Float[Array, "variables"]
    """Column norms of J; 1 for columns of zeros, parameters that these data do not see."""
    seen: Bool[Array, "variables"]
    """Which columns are not zero."""
    squares: Float[Array, ""]
    """‖r‖²."""
    lower: Float[Array, "variables"]
    """Lower bounds of z."""
    upper: Float[Array, "variables"]
    """Upper bounds of z."""

    def promised(self, z: Float[Array, "variables"]) -> Float[Array, ""]:
        """‖r‖² - ‖r + J·s‖², so written that nothing cancels where bounds hold a large gradient up."""
        change = self.matrix @ z
        return -jnp.sum(change * (2 * self.projected + change))

    def slope(self, z: Float[Array, "variables"]) -> Float[Array, ""]:
        """Derivative of half the sum of squares along z."""
        return jnp.sum((self.matrix @ z) * self.projected)

    def cosine(self) -> Float[Array, ""]:
        """Largest cosine between the residual and a column of J whose variable may move against its gradient."""
        gradient = self.matrix.T @ self.projected
        free = jnp.where(gradient > 0, self.lower < 0, self.upper > 0)
        largest = jnp.max(jnp.where(free, jnp.abs(gradient), 0.0))
        return largest / jnp.where(self.squares > 0, jnp.sqrt(self.squares), 1.0)

    def steps(self, weights: Float[Array, "variables"], radius: Float[Array, ""], guess: Float[Array, ""]) -> "Steps":
        """The Gauss-Newton step, and the best step about as long as a radius, if the former is longer.

        The latter is the damped step min ‖r + J·s‖² + λ‖weights·z‖² whose length meets the radius. 1/length is nearly
        linear in λ (Hebden 1973; Moré, "The Levenberg-Marquardt algorithm", 1978), so that a secant from the
        Gauss-Newton step at λ = 0 finds it in one or two solves. Being 25 % off is no harm.

        Args:
            weights: positive weights of z in its length.
            radius: length allowed.
            guess: λ to try first; zero if there is none.
        """
        # A damped step is never longer than this over λ.
        gradient = self.matrix.T @ self.projected
        ceiling = jnp.linalg.norm(gradient / weights) / jnp.where(radius > 0, radius, 1.0)
        first_guess = jnp.where((guess > 0) & (guess < ceiling), guess, 1e-3 * ceiling)

        def refine(carry: tuple[Steps, Array, Array, Array, Array, Array]) -> tuple:
            steps, damping, below, above, _, count = carry
            first = count == 0
            # Just enough damping of the Gauss-Newton step to make directions that the data do not see harmless.
            roots = jnp.where(first, 1e-10, jnp.sqrt(damping) * weights)
            before = (steps.damped, steps.held)
            z, active = bounded_least_squares(self.matrix, -self.projected, roots, self.lower, self.upper, before)
            steps = Steps(
                newton=jnp.where(first, z, steps.newton),
                active=jnp.where(first, active, steps.active),
                damped=z,
                held=active,
                damping=damping,
            )
            length, full = jnp.linalg.norm(weights * z), jnp.linalg.norm(weights * steps.newton)
            below = jnp.where(length > radius, damping, below)
            above = jnp.where(length < radius, damping, above)
            rise = _inverse(length) - _inverse(full)
            secant = damping * (_inverse(radius) - _inverse(full)) / jnp.where(rise > 0, rise, 1.0)
            middle = jnp.where(below > 0, jnp.sqrt(below) * jnp.sqrt(above), 1e-2 * above)
            within = (rise > 0) & (secant > below) & (secant < above)
            following = jnp.where(first, first_guess, jnp.where(within, secant, middle))
            met = (length <= _SLACK * radius) & (first | (length >= radius / _SLACK))
            return steps, following, below, above, met | (ceiling <= 0), count + 1

        def unmet(carry: tuple) -> Bool[Array, ""]:
            *_, met, count = carry
            return ~met & (count < 9)

        zero = jnp.zeros_like(ceiling)
        still, pushed = jnp.zeros_like(weights), pushed_on_bounds(gradient, self.lower, self.upper)
        nothing = Steps(newton=still, active=pushed, damped=still, held=pushed, damping=zero)
        start = (nothing, zero, zero, ceiling, jnp.asarray(False), jnp.asarray(0))
        return jax.lax.while_loop(unmet, refine, start)[0]


class Steps(eqx.Module):
    """Steps of a linear model."""

    newton: Float[Array, "variables"]
    """Gauss-Newton step z."""
    active: Bool[Array, "variables"]
    """Which variables the Gauss-Newton step leaves on a bound that holds them back."""
    damped: Float[Array, "variables"]
    """The step z within the radius."""
    held: Bool[Array, "variables"]
    """Which variables that step leaves on a bound that holds them back."""
    damping: Float[Array, ""]
    """λ of that step; zero if it is the Gauss-Newton step."""


_SLACK = 1.25


def linear_model(
    residual: Float[Array, "residuals"],
    jacobian: Float[Array, "residuals variables"],
    lower: Float[Array, "variables"],
    upper: Float[Array, "variables"],
) -> LinearModel:
    """The linear model of a residual around a point.

    Args:
        residual: r there.
        jacobian: J there.
        lower: lower bounds of the step, at most zero.
        upper: upper bounds of the step, at least zero.
    """
    triangle, projected = orthogonal_triangle(jacobian, residual)
    norms = jnp.sqrt(jnp.sum(triangle**2, axis=0))
    seen = norms > 0
    norms = jnp.where(seen, norms, 1.0)
    return LinearModel(
        matrix=triangle / norms,
        projected=projected,
        norms=norms,
        seen=seen,
        squares=jnp.sum(residual**2),
        lower=lower * norms,
        upper=upper * norms,
    )


def _inverse(value: Array) -> Array:
    return 1 / jnp.maximum(value, 1e-300)
