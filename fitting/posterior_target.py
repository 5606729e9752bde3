"""The log density that a sampler of the posterior moves on: evidence, priors and bounds in unbounded coordinates."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.objective import Objective
from fitting.solve import linearised
from twin._checks import InputError
from twin.parameters import ParameterSpace


class Box(eqx.Module):
    """A smooth map from unbounded coordinates u into the bounds of a scaled vector x, coordinate by coordinate.

    x = u + w·[s((lower - u)/w) - s((u - upper)/w)] with s(v) = ln(1 + exp(v)): the identity without bounds and far from
    them in terms of the width w, exponential close to one, a logistic function between two that are close together. A
    plain exponential or logistic map bends over the whole range, however narrow the posterior is in it.
    """

    lower: Float[Array, "parameters"]
    """Lower bounds of the scaled vector; may be infinite."""
    upper: Float[Array, "parameters"]
    """Upper bounds."""
    width: Float[Array, "parameters"]
    """Width w over which a bound bends the map."""

    def inside(self, u: Float[Array, "parameters"]) -> Float[Array, "parameters"]:
        """From unbounded coordinates to the scaled vector."""
        below, above = (self.lower - u) / self.width, (u - self.upper) / self.width
        x = u + self.width * (jax.nn.softplus(below) - jax.nn.softplus(above))
        return jnp.clip(x, self.lower, self.upper)  # for what rounding leaves

    def log_slope(self, u: Float[Array, "parameters"]) -> Float[Array, "parameters"]:
        """ln(dx/du): what the density gains from the map."""
        below, above = (self.lower - u) / self.width, (u - self.upper) / self.width
        both = jnp.log(-jnp.expm1((self.lower - self.upper) / self.width))
        return jax.nn.log_sigmoid(-below) + jax.nn.log_sigmoid(-above) + both

    def outside(self, x: Float[Array, "parameters"]) -> Float[Array, "parameters"]:
        """From a scaled vector strictly within the bounds to unbounded coordinates."""
        below, above = (self.lower - x) / self.width, (x - self.upper) / self.width
        return x + self.width * (jnp.log(-jnp.expm1(below)) - jnp.log(-jnp.expm1(above)))


class Target(eqx.Module):
    """The posterior as a function of whitened coordinates z, in which it is roughly a standard normal one."""

    objective: Objective
    """Evidence, and what is free."""
    box: Box
    """Bounds."""
    centre: Float[Array, "parameters"]
    """Unbounded coordinates at z = 0."""
    root: Float[Array, "parameters parameters"]
    """Root of the linear-theory covariance of the unbounded coordinates."""
    variance: str = eqx.field(static=True)
    """"estimated" or "known"."""

    def vector(self, z: Float[Array, "parameters"]) -> Float[Array, "parameters"]:
        """The scaled vector."""
        return self.box.inside(self.centre + self.root @ z)

    def whitened(self, x: Float[Array, "parameters"]) -> Float[Array, "parameters"]:
        """Whitened coordinates of a scaled vector strictly within the bounds."""
        return jnp.linalg.solve(self.root, self.box.outside(x) - self.centre)

    def log_density(self, z: Float[Array, "parameters"]) -> Float[Array, ""]:
        """Logarithm of the posterior density of z but for a constant; may be NaN where the model fails."""
        u = self.centre + self.root @ z
        rows, _ = self.objective(self.box.inside(u))
        data, prior = split(self.objective, rows)
        square = jnp.sum(data**2)
        evidence = -0.5 * square if self.variance == "known" else -0.5 * data.size * jnp.log(square)
        return evidence - 0.5 * jnp.sum(prior**2) + jnp.sum(self.box.log_slope(u))


def split(objective: Objective, rows: Float[Array, "rows *rest"]) -> tuple[Array, Array]:
    """Rows of the data, and rows of the priors.

    Args:
        objective: of the fit.
        rows: its residual or Jacobian.
    """
    priors = sum(p.prior is not None for p in objective.space.parameters)
    return rows[: rows.shape[0] - priors], rows[rows.shape[0] - priors :]


def with_forward_gradient(target: Target) -> Callable[[Array], Array]:
    """The log density with a gradient by forward mode, for samplers that ask for reverse mode.

    Parameters are few, and a simulation under the residual may not support reverse mode. Where the density is not
    finite it is -∞ and its gradient zero: such a point is never accepted.

    Args:
        target: the posterior.
    """

    def value_of(z: Array) -> tuple[Array, Array]:
        value = target.log_density(z)
        return value, value

    @jax.custom_vjp
    def density(z: Array) -> Array:
        value = target.log_density(z)
        return jnp.where(jnp.isfinite(value), value, -jnp.inf)

    def forward(z: Array) -> tuple[Array, Array]:
        gradient, value = jax.jacfwd(value_of, has_aux=True)(z)
        good = jnp.isfinite(value)
        return jnp.where(good, value, -jnp.inf), jnp.where(good & jnp.all(jnp.isfinite(gradient)), gradient, 0.0)

    def backward(gradient: Array, cotangent: Array) -> tuple[Array]:
        return (cotangent * gradient,)

    density.defvjp(forward, backward)
    return density


def whitened_target(objective: Objective, variance: str) -> Target:
    """The posterior around a model, whitened by linear theory there.

    Args:
        objective: evidence; its model is the centre.
        variance: "estimated" or "known".

    Raises:
        InputError: evidence that is not finite at the centre, no data left over to estimate a variance from, or a
            combination of unbounded parameters that neither data nor priors see: such a posterior does not exist.
    """
    space = objective.space
    x = np.asarray(space.pack(objective.model))
    jacobian, (rows, _) = linearised(objective, jnp.asarray(x))
    if not (np.all(np.isfinite(rows)) and np.all(np.isfinite(jacobian))):
        raise InputError(
            "The residual or its derivative is not finite at the model given. Give a fitted model, or one that can be "
            "simulated."
        )
    (data, _), (data_slopes, prior_slopes) = split(objective, rows), split(objective, jacobian)
    freedom = data.size - len(space)
    if variance == "estimated" and freedom < 1:
        raise InputError(
            f"{data.size} residuals are not enough to estimate {len(space)} parameters and a variance from. "
            'Use variance="known" if the weights are exact, or add data.'
        )
    square = 1.0 if variance == "known" else max(float(data @ data) / freedom, np.finfo(float).tiny)
    information = np.vstack([np.asarray(data_slopes) / np.sqrt(square), np.asarray(prior_slopes)])

    lower, upper = np.asarray(space.lower), np.asarray(space.upper)
    # Between two bounds the values spread by the range over √12, if the data say nothing.
    bounds = np.diag(np.sqrt(12) / (upper - lower))
    width = np.linalg.norm(_root(np.vstack([information, bounds]), space), axis=1)
    box = Box(space.lower, space.upper, jnp.asarray(width))
    margin = np.minimum(width * np.log(2), 0.25 * (upper - lower))
    centre = box.outside(jnp.asarray(np.clip(x, lower + margin, upper - margin)))
    rows_of_u = np.vstack([information * np.exp(np.asarray(box.log_slope(centre))), 0.5 * bounds])
    return Target(objective, box, centre, jnp.asarray(_root(rows_of_u, space)), variance)


def _root(rows: np.ndarray, space: ParameterSpace) -> np.ndarray:
    """Root of the inverse of rowsᵀ·rows."""
    norms = np.linalg.norm(rows, axis=0)
    scaled = rows / np.where(norms > 0, norms, 1.0)
    _, values, rotations = np.linalg.svd(scaled, full_matrices=False)
    unseen = values <= max(rows.shape) * np.finfo(float).eps * values[0]
    if unseen.any():
        taking = np.linalg.norm(rotations[unseen], axis=0) > 1e-6
        raise InputError(
            f"Neither data nor priors limit {space.named(taking)}: there is no posterior. Give them a prior or two "
            "finite bounds, or leave them out of the space."
        )
    return rotations.T / values / norms[:, None]
