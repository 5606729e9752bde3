"""Robust losses: how much a residual of some size counts, so that outliers do not decide a fit.

With z = r/c the cost of a residual is c²·ρ(z²)/2 instead of r²/2. From it come the score ψ = r·ρ'(z²), which says how
hard a residual pulls, and its slope ψ' (P. J. Huber, E. M. Ronchetti, Robust Statistics, 2nd ed. 2009, ch. 3 and 7).
A least-squares solver minimises this cost if it is given φ(r) with φ² = c²·ρ(z²) as its residual.
"""

import abc

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from twin._checks import as_scalar, positive

# Where 1 + z² equals z² in double precision, long before z² overflows.
_FAR = 1e8
# Below this the series of ln(1 + s)/s is used; its first omitted term is below 1e-19.
_NEAR = 1e-3


class AbstractLoss(eqx.Module):
    """A loss that grows like the square for small residuals and slower for large ones.

    A new loss gives two even functions of z = r/c; everything else follows. Both must stay finite for all z, and
    `attenuation` above zero.
    """

    threshold: eqx.AbstractVar[Float[Array, ""]]
    """Residual c at which the loss leaves the square, in standard deviations of the noise [-]."""

    def __check_init__(self):
        positive("threshold", self.threshold)

    @abc.abstractmethod
    def attenuation(self, z: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        """φ/r = √(ρ(z²))/|z|, one at zero."""

    @abc.abstractmethod
    def weight(self, z: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        """ψ/r = ρ'(z²), one at zero: the weight in an iteratively reweighted fit."""

    def __call__(self, residual: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        """φ(r), whose square is the loss; smooth through zero, with derivative ψ/φ.

        Args:
            residual: weighted residual r; its noise has unit standard deviation. What is not finite stays so.
        """
        z = residual / self.threshold
        shrunk = self.attenuation(z)
        return self.threshold * _with_slope(z * shrunk, self.weight(z) / shrunk, z)

    def cost(self, residual: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        """c²·ρ(z²), which is r² for small residuals."""
        z = residual / self.threshold
        return (residual * self.attenuation(z)) ** 2

    def score(self, residual: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        """ψ(r) = r·ρ'(z²), half the derivative of the cost."""
        return residual * self.weight(residual / self.threshold)

    def score_slope(self, residual: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        """ψ'(r), negative where the loss descends again."""
        return jax.jvp(self.score, (residual,), (jnp.ones_like(residual),))[1]

    def curvature(self, residual: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        """ψ'/φ'²: the true curvature of the cost over the one that a solver sees who is given φ.

        One for small residuals, zero for those that no longer pull at all.
        """
        z = residual / self.threshold
        weight, shrunk = self.weight(z), self.attenuation(z)
        pulls = weight > 0
        safe = jnp.where(pulls, weight, 1.0)
        return jnp.where(pulls, self.score_slope(residual) / safe * (shrunk / safe) * shrunk, 0.0)


class SoftL1Loss(AbstractLoss):
    """ρ(s) = 2(√(1 + s) - 1): a smooth transition from the square to the absolute value."""

    threshold: Float[Array, ""] = eqx.field(converter=as_scalar, default=1.287)
    """Residual c at which the loss leaves the square [-]; by default 95 % efficient for normal noise."""

    def attenuation(self, z: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        return jnp.sqrt(2 / (1 + _hypotenuse(z)))

    def weight(self, z: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        return 1 / _hypotenuse(z)


class HuberLoss(AbstractLoss):
    """ρ(s) = s up to 1, then 2√s - 1: the square, then the absolute value. A residual pulls never harder than c."""

    threshold: Float[Array, ""] = eqx.field(converter=as_scalar, default=1.345)
    """Residual c at which the loss leaves the square [-]; by default 95 % efficient for normal noise."""

    def attenuation(self, z: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        size = jnp.where(jnp.abs(z) <= 1, 1.0, jnp.abs(z))
        return jnp.sqrt(2 * size - 1) / size

    def weight(self, z: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        return 1 / jnp.where(jnp.abs(z) <= 1, 1.0, jnp.abs(z))


class CauchyLoss(AbstractLoss):
    """ρ(s) = ln(1 + s): the pull falls off beyond c, as 1/r, but never ends."""

    threshold: Float[Array, ""] = eqx.field(converter=as_scalar, default=2.385)
    """Residual c at which the pull is largest [-]; by default 95 % efficient for normal noise."""

    def attenuation(self, z: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        far, near = jnp.abs(z) > _FAR, z**2 < _NEAR
        middle = jnp.where(far | near, 1.0, z) ** 2
        tiny = jnp.where(near, z, 0.0) ** 2
        huge = jnp.where(far, jnp.abs(z), _FAR)
        series = 1 - tiny * (1 / 2 - tiny * (1 / 3 - tiny * (1 / 4 - tiny * (1 / 5 - tiny / 6))))
        ratio = jnp.sqrt(jnp.where(near, series, jnp.log1p(middle) / middle))
        return jnp.where(far, jnp.sqrt(2 * jnp.log(huge)) / huge, ratio)

    def weight(self, z: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        return 1 / _hypotenuse(z) / _hypotenuse(z)


class TukeyLoss(AbstractLoss):
    """ρ(s) = (1 - (1 - s)³)/3 up to 1, then 1/3: what is farther off than c does not pull at all.

    Its cost has several minima: start it from the result of a fit with `HuberLoss`.
    """

    threshold: Float[Array, ""] = eqx.field(converter=as_scalar, default=4.685)
    """Residual c from which on nothing pulls [-]; by default 95 % efficient for normal noise."""

    def attenuation(self, z: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        inside = jnp.abs(z) < 1
        s = jnp.where(inside, z, 0.0) ** 2
        return jnp.where(inside, jnp.sqrt(1 - s + s**2 / 3), 1 / jnp.sqrt(3.0) / jnp.where(inside, 1.0, jnp.abs(z)))

    def weight(self, z: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        return (1 - jnp.where(jnp.abs(z) < 1, z, 1.0) ** 2) ** 2


def _hypotenuse(z: Array) -> Array:
    """√(1 + z²) without overflow."""
    far = jnp.abs(z) > _FAR
    return jnp.where(far, jnp.abs(z), jnp.sqrt(1 + jnp.where(far, 0.0, z) ** 2))


# The derivative ψ/φ in closed form: neither the root at zero nor a seam or an overflow can spoil it.
@jax.custom_jvp
def _with_slope(value: Array, slope: Array, z: Array) -> Array:
    del slope, z
    return value


@_with_slope.defjvp
def _slope_rule(primals: tuple, tangents: tuple) -> tuple[Array, Array]:
    value, slope, _ = primals
    return value, slope * tangents[2]
