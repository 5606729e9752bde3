"""A line on a component along which the place of attachment travels: shapes as a smooth function of the coordinate."""

import functools
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from twin._checks import InputError, as_array, finite, increasing, is_concrete

# A coordinate beyond the end by less than this share of the length is one that rounding put there.
_ROUNDING = 1e-9


def _as_floats(value: Any) -> tuple[float, ...]:
    array = np.asarray(value, dtype=np.float64)
    if array.ndim != 1 or array.size < 4:
        raise InputError(
            f"coordinate must be a vector of at least four points on the rail, but has the shape {array.shape}. A "
            "spline that bends needs four."
        )
    increasing("coordinate", array, "m")
    return tuple(array.tolist())


class Rail(eqx.Module):
    """Mode shapes along a line: guide rail, screw shaft. Between the points they follow a cubic spline, which is twice
    continuously differentiable in the coordinate (ends: not a knot).

    Raises:
        InputError: fewer than four points, points that do not increase, shapes of another length or not finite.

    Source: C. de Boor, "A Practical Guide to Splines", 1978, ch. IV.
    """

    coordinate: tuple[float, ...] = eqx.field(static=True, converter=_as_floats)
    """Where along the rail the shapes are given, strictly increasing, (points,) [m]. Fixed, as the spline is made from
    it: what can be varied is the coordinate asked for."""
    shapes: Float[Array, "points 6 modes"] = eqx.field(converter=as_array)
    """Mass-normalised shapes there, in x, y, z, rx, ry, rz [1/√kg, 1/(m√kg)]."""

    def __check_init__(self):
        shape = getattr(self.shapes, "shape", None)
        if shape is not None and (len(shape) != 3 or shape[:2] != (len(self.coordinate), 6)):
            raise InputError(
                f"shapes of a rail must be (points, 6 directions, modes) with {len(self.coordinate)} points as its "
                f"coordinate has, but have the shape {shape}. Check that both come from the same model."
            )
        finite("shapes of a rail", self.shapes)

    def at(self, coordinate: Float[ArrayLike, "*places"]) -> Float[Array, "*places 6 modes"]:
        """The shapes at coordinates on the rail.

        Args:
            coordinate: where [m]; one number or many.

        Returns:
            Shapes in x, y, z, rx, ry, rz; NaN off the rail where the coordinate is traced.

        Raises:
            InputError: a coordinate off the rail.
        """
        self.check(coordinate)
        s = jnp.asarray(coordinate, dtype=jnp.float64)
        points, pieces = np.asarray(self.coordinate), jnp.asarray(_cardinal_splines(self.coordinate))
        slack = _ROUNDING * (points[-1] - points[0])
        s = jnp.where((s >= points[0] - slack) & (s <= points[-1] + slack), s, jnp.nan)
        piece = jnp.sum(s[..., None] >= points[1:-1], axis=-1)
        along = (s - jnp.asarray(points)[piece])[..., None]
        cubic, square, slope, value = jnp.moveaxis(pieces[piece], -2, 0)
        weights = ((cubic * along + square) * along + slope) * along + value
        return jnp.tensordot(weights, self.shapes, axes=1)

    def check(self, coordinate: Float[ArrayLike, "*places"], name: str = "the rail") -> None:
        """Raise unless coordinates lie on the rail. Traced values pass.

        Args:
            coordinate: where [m]; one number or many.
            name: what the rail is called, for the message.

        Raises:
            InputError: a coordinate off the rail.
        """
        if not is_concrete(coordinate):
            return
        first, last = self.coordinate[0], self.coordinate[-1]
        slack = _ROUNDING * (last - first)
        for s in np.ravel(np.asarray(coordinate)):
            if not first - slack <= s <= last + slack:
                raise InputError(
                    f"The coordinate {s:g} m is off {name}, which runs from {first:g} to {last:g} m. Check the axis "
                    "position and the attachment's offset, which add up to the coordinate."
                )


@functools.lru_cache(maxsize=256)
def _cardinal_splines(points: tuple[float, ...]) -> np.ndarray:
    """Coefficients (pieces, 4 powers, points) of the splines that are 1 at one point and 0 at all others."""
    from scipy.interpolate import CubicSpline

    return np.moveaxis(CubicSpline(points, np.eye(len(points))).c, 0, 1)
