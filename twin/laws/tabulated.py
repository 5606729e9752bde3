"""Friction given as a table of force over speed."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, as_array, finite, increasing
from twin.laws.friction import AbstractStaticFriction


class TabulatedFriction(AbstractStaticFriction):
    """A piecewise cubic curve through measured points, with a continuous slope and no overshoot between the points.

    Between two points the curve is monotone: where the table rises, so does the curve. Outside, it goes on straight
    with the slope of its end, so the table should cover the speeds that occur. The force is differentiable with respect
    to the speed and to the table's forces and speeds; with respect to the table one-sidedly where two neighbouring
    forces are equal. The reversal at zero speed is as sharp as the table makes it: put several points around zero.

    Raises:
        InputError: if there are fewer than two points, the speeds do not increase strictly, the lengths differ, or any
            entry is not finite.

    The curve is interpax's; its speeds are checked here, as interpax takes any order of them.

    Source: F. N. Fritsch, J. Butland, "A method for constructing local monotone piecewise cubic interpolants", SIAM
    J. Sci. Stat. Comput. 5 (1984) 300-304; end slopes by the limited three-point formula of PCHIP.
    """

    velocities: Float[Array, " points"] = eqx.field(converter=as_array)
    """Speeds of the table, strictly increasing, shape (points,) [m/s or rad/s]."""
    forces: Float[Array, " points"] = eqx.field(converter=as_array)
    """Friction forces at these speeds, positive against positive motion, shape (points,) [N or Nm]."""

    def __check_init__(self):
        # A tree transformation may have put placeholders in the place of the arrays.
        shape, force_shape = getattr(self.velocities, "shape", None), getattr(self.forces, "shape", None)
        if shape is None or force_shape is None:
            return
        if len(shape) != 1 or shape[0] < 2:
            raise InputError(
                f"velocities must be a vector of at least two speeds, but has the shape {shape}. Give a measured curve."
            )
        if force_shape != shape:
            raise InputError(
                f"forces must have one entry for each of the {shape[0]} velocities, but has the shape {force_shape}. "
                "Check that both come from the same table."
            )
        increasing("velocities", self.velocities, "m/s")
        finite("forces", self.forces, "N")

    def __call__(self, velocity: Float[ArrayLike, "*batch"]) -> Float[Array, "*batch"]:
        import interpax  # only tables need it

        x, y = self.velocities, self.forces
        slopes = interpax.approx_df(x, y, "monotonic")
        # interpax.interp1d is the same curve, but many times slower inside of an integrator's loop.
        curve = interpax.CubicHermiteSpline(x, y, slopes, check=False)
        velocity = jnp.asarray(velocity)
        below, above = velocity < x[0], velocity > x[-1]
        inside = jnp.where(below, x[0], jnp.where(above, x[-1], velocity))
        return curve(inside) + jnp.where(below, slopes[0], slopes[-1]) * (velocity - inside)
