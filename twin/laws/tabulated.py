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
        x, y = self.velocities, self.forces
        slopes = _monotone_slopes(x, y)
        velocity = jnp.asarray(velocity)
        below, above = velocity < x[0], velocity > x[-1]
        inside = jnp.where(below, x[0], jnp.where(above, x[-1], velocity))
        # Comparing with all points at once beats a search loop for tables of tens of points inside an integrator.
        interval = jnp.clip(jnp.searchsorted(x, inside, side="right", method="compare_all") - 1, 0, x.size - 2)
        step = x[interval + 1] - x[interval]
        s = (inside - x[interval]) / step
        curve = (
            (1 + 2 * s) * (1 - s) ** 2 * y[interval]
            + s**2 * (3 - 2 * s) * y[interval + 1]
            + s * (1 - s) * step * ((1 - s) * slopes[interval] - s * slopes[interval + 1])
        )
        return curve + jnp.where(below, slopes[0], slopes[-1]) * (velocity - inside)


def _monotone_slopes(x: Float[Array, " points"], y: Float[Array, " points"]) -> Float[Array, " points"]:
    step = jnp.diff(x)
    chord = jnp.diff(y) / step
    if x.size == 2:
        return jnp.stack([chord[0], chord[0]])
    left, right = chord[:-1], chord[1:]
    weight_left = 2 * step[1:] + step[:-1]
    weight_right = step[1:] + 2 * step[:-1]
    same_direction = left * right > 0
    # Weighted harmonic mean of the two chords, multiplied out so that a chord of zero divides nothing.
    mean = (weight_left + weight_right) * left * right
    inner = jnp.where(same_direction, mean / jnp.where(same_direction, weight_left * right + weight_right * left, 1), 0)
    first = _end_slope(step[0], step[1], chord[0], chord[1])
    last = _end_slope(step[-1], step[-2], chord[-1], chord[-2])
    return jnp.concatenate([first[None], inner, last[None]])


def _end_slope(step: Array, next_step: Array, chord: Array, next_chord: Array) -> Float[Array, ""]:
    slope = ((2 * step + next_step) * chord - step * next_chord) / (step + next_step)
    turning = (chord * next_chord < 0) & (jnp.abs(slope) > 3 * jnp.abs(chord))
    return jnp.where(slope * chord <= 0, 0, jnp.where(turning, 3 * chord, slope))
